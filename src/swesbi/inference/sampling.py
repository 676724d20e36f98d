"""Draws from the estimator itself, without any rejection: always as many as asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from swesbi.inference.determinism import reproducible
from swesbi.inference.maf import MaskedFlow
from swesbi.inference.sequential import for_drawing
from swesbi.prior import PriorSettings, in_bounds

FloatArray = NDArray[np.float64]

ROWS_PER_BATCH = 10_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


class Sampler(Protocol):
    """A density estimator that can be sampled: the trained one, or a checkpoint of its training."""

    @property
    def net(self) -> MaskedFlow:
        """The density estimator."""

    @property
    def components(self) -> tuple[str, ...]:
        """The names of its C inputs."""


def draw_candidates(estimator: Sampler, z: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw theta ~ q(theta | z) for each conditioning vector, inside the prior's bounds or not.

    sbi's own sampler rejects draws outside the prior until it has enough, which need never happen;
    here time and memory are bounded by ``draws``.

    Args:
        estimator: The density estimator.
        z: (B, C) standardised conditioning vectors.
        draws: Number of draws for each.
        seed: Seed of the draws.

    Returns:
        Array of shape (B, draws, 3).

    Raises:
        ValueError: z has another number of components than the estimator.
    """
    if z.ndim != 2 or z.shape[1] != len(estimator.components):
        raise ValueError(f"z has shape {z.shape}, the estimator takes {len(estimator.components)} components")
    condition, net = torch.from_numpy(z.astype(np.float32)), for_drawing(estimator.net)
    with reproducible(seed), torch.no_grad():
        sampled = [_draw(net, row[None], draws) for row in condition]
    return np.stack(sampled)


def draw_until(
    estimator: Sampler, z: FloatArray, enough: int, at_most: int, prior: PriorSettings, seed: int
) -> FloatArray:
    """Draw candidates for one conditioning vector until ``enough`` lie within the prior's bounds.

    The candidates are the first of those that ``draw_candidates`` gives for ``at_most`` draws under the
    same seed, so a criterion of so many in-prior draws has the same outcome, sooner.

    Args:
        estimator: The density estimator.
        z: (C,) standardised conditioning vector.
        enough: In-prior draws after which drawing stops.
        at_most: Candidates after which it stops in any case.
        prior: The prior whose bounds count.
        seed: Seed of the draws.

    Returns:
        Array of shape (n, 3), in whole batches of ``ROWS_PER_BATCH``, n <= at_most.
    """
    condition, net = torch.from_numpy(z[None].astype(np.float32)), for_drawing(estimator.net)
    drawn: list[FloatArray] = []
    found = 0
    with reproducible(seed), torch.no_grad():
        for batch in _batches(net, condition, at_most):
            drawn.append(batch)
            found += int(in_bounds(batch, prior).sum())
            if found >= enough:
                break
    return np.concatenate(drawn)


def losses(estimator: Sampler, theta: FloatArray, z: FloatArray) -> FloatArray:
    """Return -log q(theta | z) of each row, as training counts it; theta (N, 3), z (N, C), result (N,)."""
    rows = [torch.from_numpy(values.astype(np.float32)) for values in (theta, z)]
    with reproducible(0), torch.no_grad():
        density: FloatArray = estimator.net.log_prob(*rows).numpy().astype(np.float64)
    return -density


def _draw(net: MaskedFlow, row: torch.Tensor, draws: int) -> FloatArray:
    return np.concatenate(list(_batches(net, row, draws)))


def _batches(net: MaskedFlow, row: torch.Tensor, draws: int) -> Iterator[FloatArray]:
    sizes = [ROWS_PER_BATCH] * (draws // ROWS_PER_BATCH) + [draws % ROWS_PER_BATCH]
    for size in sizes:
        if size:
            yield net.sample(size, row).numpy().astype(np.float64)
