"""What was trained, or estimated, under other settings than the configuration's is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from swesbi.networks.flow.trained import SHIPPED_NETWORK, TrainedFlow
from swesbi.study.contents import flatten

ABSENT: Final = str(None)
NAME: Final = "experiment"
"""The setting by which progress lines call a training."""


class OtherNetworkError(ValueError):
    """The network was trained under other settings than these."""


def check_network(estimator: Path, settings: Mapping[str, Any]) -> None:
    """Refuse a network that was trained under other settings than those of the configuration.

    A setting that is null is one that is not there, as in a network trained before there was such a setting.
    The network of the package is of the shipped recordings; under another protocol it proposes less well, and
    weights correct it. So of its settings the model alone must be that of the configuration.
    """
    trained = TrainedFlow.load(estimator)[1].settings
    if estimator == SHIPPED_NETWORK:
        settings, trained = ({"model": each["model"]} for each in (settings, trained))
    if fault := difference(trained, settings):
        raise OtherNetworkError(f"{estimator}: {fault}")


def difference(trained: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    """Return the first setting in which a network was trained otherwise, in words; empty if there is none."""
    here, there = (
        flatten({key: value for key, value in each.items() if key != NAME}) for each in (settings, trained)
    )
    for key in sorted(here.keys() | there.keys()):
        if here.get(key, ABSENT) != there.get(key, ABSENT):
            return (
                f"was trained with {key} = {there.get(key)}, the configuration has {here.get(key)}; run the "
                "study again, or use the configuration that it was trained with"
            )
    return ""
