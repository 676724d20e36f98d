"""Draws from the estimator itself, without any rejection: always as many as asked for."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from swesbi.inference.determinism import reproducible

if TYPE_CHECKING:
    from sbi.neural_nets.estimators import ConditionalDensityEstimator

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]

ROWS_PER_BATCH = 10_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


class Sampler(Protocol):
    """A density estimator that can be sampled: the trained one, or a checkpoint of its training."""

    @property
    def net(self) -> ConditionalDensityEstimator:
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
    condition = torch.from_numpy(z.astype(np.float32))
    with reproducible(seed), torch.no_grad():
        sampled = [_draw(estimator, row[None], draws) for row in condition]
    return np.stack(sampled)


def _draw(estimator: Sampler, row: torch.Tensor, draws: int) -> FloatArray:
    sizes = [ROWS_PER_BATCH] * (draws // ROWS_PER_BATCH) + [draws % ROWS_PER_BATCH]
    batches = [estimator.net.sample((size,), condition=row)[:, 0] for size in sizes if size]
    theta: FloatArray = torch.cat(batches).numpy().astype(np.float64)
    return theta
