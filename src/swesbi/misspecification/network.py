"""How well a network knew a recording, as a line of the verdict."""

from __future__ import annotations

from collections.abc import Sequence

from swesbi.inference.support import SupportTest


def network_test(efficiency: Sequence[float], min_efficiency: float) -> SupportTest:
    """Say how well the network knew the recording; the weights make good for it, so it is never flagged.

    Args:
        efficiency: Of the network's own draws, and of each proposal that was fitted after it.
        min_efficiency: Below it, a proposal is fitted.
    """
    rounds = len(efficiency) - 1
    after = (
        f"; {rounds} proposals fitted to the recording brought it to {efficiency[-1]:.0%}" if rounds else ""
    )
    return SupportTest(
        name="network",
        statistic=efficiency[0],
        p_value=None,
        threshold=min_efficiency,
        flagged=False,
        detail=f"{efficiency[0]:.1%} of the network's own draws are effective{after}",
    )
