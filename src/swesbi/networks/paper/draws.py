"""Draws and losses of the density estimator; the points of the base space are those that sbi would draw."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import torch

from swesbi.base.arrays import FloatArray
from swesbi.networks.determinism import reproducible
from swesbi.networks.paper.estimator import TrainedEstimator
from swesbi.prior import PriorSettings, in_bounds

ROWS_PER_BATCH: Final = 10_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


def draw_candidates(estimator: TrainedEstimator, z: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw theta ~ q(theta | z) for each z (B, C), inside the prior's bounds or not; (B, draws, 3).

    sbi's own sampler rejects draws outside the prior until it has enough, which need never happen.
    """
    if z.ndim != 2 or z.shape[1] != len(estimator.components):
        raise ValueError(f"z has shape {z.shape}, the estimator takes {len(estimator.components)} components")
    with reproducible(seed):
        return np.stack([np.concatenate(list(_batches(estimator, row, draws))) for row in z])


def draw_until(
    estimator: TrainedEstimator, z: FloatArray, enough: int, at_most: int, prior: PriorSettings, seed: int
) -> FloatArray:
    """Draw candidates for one z (C,) in whole batches until ``enough`` lie within the prior's bounds; (n, 3).

    They are the first of those that ``draw_candidates`` gives for ``at_most`` draws under the same seed, so a
    criterion of so many in-prior draws has the same outcome, sooner.
    """
    drawn: list[FloatArray] = []
    inside = 0
    with reproducible(seed):
        for batch in _batches(estimator, z, at_most):
            drawn.append(batch)
            inside += int(in_bounds(batch, prior).sum())
            if inside >= enough:
                break
    return np.concatenate(drawn)


def losses(estimator: TrainedEstimator, theta: FloatArray, z: FloatArray) -> FloatArray:
    """Return -log q(theta | z) of each row, as training counts it; theta (N, 3), z (N, C), result (N,)."""
    return -estimator.net.log_prob(theta, z)


def _batches(estimator: TrainedEstimator, z: FloatArray, draws: int) -> Iterator[FloatArray]:
    for start in range(0, draws, ROWS_PER_BATCH):
        base = torch.randn(min(ROWS_PER_BATCH, draws - start), len(estimator.net.base))
        yield estimator.net.at(base.numpy(), z)
