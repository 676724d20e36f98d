"""Each subject's posterior within its population: its recycled draws, reweighted by what the cohort tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.model import BLOCK, CohortModel

IntArray = NDArray[np.int_]


@dataclass(frozen=True)
class Shrunken:
    """What the population makes of the subjects.

    Attributes:
        weights: Of each subject's recycled draws, averaged over the population's posterior; (n,) each.
        rows: One recycled draw of each subject for each hyperdraw, joint draws of all; shape (m, d).
        effective: Effective number of each subject's recycled draws, averaged likewise; shape (d,).
        outlier: Posterior probability of each subject to be none of the population; shape (d,).
        log_likelihood: Of each subject under each hyperdraw; shape (m, d).
    """

    weights: tuple[FloatArray, ...]
    rows: IntArray
    effective: FloatArray
    outlier: FloatArray
    log_likelihood: FloatArray


def shrink(model: CohortModel, eta: FloatArray, rng: np.random.Generator) -> Shrunken:
    """Reweight the recycled draws of every subject by draws eta (m, k) of the population's posterior.

    Given eta, a draw weighs w_n ((1 - p) p(theta_n | eta) / pi(theta_n) + p), over the sum of all, which is
    the subject's likelihood; what is averaged over eta are these normalised weights.
    """
    levels = rng.random((len(eta), len(model.recycled)))
    blocks = [
        [
            _of_subject(model, number, ratio, levels[block * BLOCK :, number])
            for number, ratio in enumerate(ratios)
        ]
        for block, ratios in enumerate(model.log_ratios(eta))
    ]
    subjects = [_joined(parts) for parts in zip(*blocks, strict=True)]
    return Shrunken(
        weights=tuple(one.weight / len(eta) for one in subjects),
        rows=np.stack([one.rows for one in subjects], axis=1),
        effective=np.array([one.effective.mean() for one in subjects]),
        outlier=np.array([one.outlier.mean() for one in subjects]),
        log_likelihood=np.stack([one.log_likelihood for one in subjects], axis=1),
    )


@dataclass(frozen=True)
class _Part:
    """One subject under a block of hyperdraws; weights are summed over these."""

    weight: FloatArray
    rows: IntArray
    effective: FloatArray
    outlier: FloatArray
    log_likelihood: FloatArray


def _of_subject(model: CohortModel, number: int, log_ratio: FloatArray, levels: FloatArray) -> _Part:
    p = float(model.outlier[number])
    own = np.exp(model.recycled[number].log_weight)
    largest = np.maximum(log_ratio.max(axis=1), 0.0)[:, None]
    weight = (1.0 - p) * np.exp(log_ratio - largest) + p * own * np.exp(-largest)
    total = weight.sum(axis=1)
    weight /= total[:, None]
    edges = np.cumsum(weight, axis=1)
    drawn = (edges < levels[: len(weight), None] * edges[:, -1:]).sum(axis=1)
    return _Part(
        weight=weight.sum(axis=0),
        rows=np.asarray(drawn),
        effective=np.asarray(1.0 / (weight**2).sum(axis=1)),
        outlier=np.asarray(p * np.exp(-largest[:, 0]) / total),
        log_likelihood=np.asarray(largest[:, 0] + np.log(total)),
    )


def _joined(parts: tuple[_Part, ...]) -> _Part:
    return _Part(
        weight=np.sum([part.weight for part in parts], axis=0),
        rows=np.concatenate([part.rows for part in parts]),
        effective=np.concatenate([part.effective for part in parts]),
        outlier=np.concatenate([part.outlier for part in parts]),
        log_likelihood=np.concatenate([part.log_likelihood for part in parts]),
    )
