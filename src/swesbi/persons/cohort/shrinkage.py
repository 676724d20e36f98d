"""Each subject's posterior within its population: its recycled draws, reweighted by what the cohort tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.model import BLOCK, CohortModel

IntArray = NDArray[np.int_]


@dataclass(frozen=True)
class Shrinkage:
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


def shrink(model: CohortModel, eta: FloatArray, rng: np.random.Generator) -> Shrinkage:
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
    by_subject = [zip(*parts, strict=True) for parts in zip(*blocks, strict=True)]
    joined = [(np.sum(weight, axis=0), *map(np.concatenate, rest)) for weight, *rest in by_subject]
    weights, rows, effective, outlier, log_likelihood = zip(*joined, strict=True)
    return Shrinkage(
        weights=tuple(weight / len(eta) for weight in weights),
        rows=np.stack(rows, axis=1),
        effective=np.array([one.mean() for one in effective]),
        outlier=np.array([one.mean() for one in outlier]),
        log_likelihood=np.stack(log_likelihood, axis=1),
    )


def _of_subject(
    model: CohortModel, number: int, log_ratio: FloatArray, levels: FloatArray
) -> tuple[NDArray[Any], ...]:
    """Return a subject under a block of hyperdraws: the sum of its weights over these, and the rest of each.

    It is one drawn row, the effective number of draws, the probability of an outlier, the log likelihood.
    """
    p = float(model.outlier[number])
    own = np.exp(model.recycled[number].log_weight)
    largest = np.maximum(log_ratio.max(axis=1), 0.0)[:, None]
    weight = (1.0 - p) * np.exp(log_ratio - largest) + p * own * np.exp(-largest)
    total = weight.sum(axis=1)
    weight /= total[:, None]
    edges = np.cumsum(weight, axis=1)
    drawn = (edges < levels[: len(weight), None] * edges[:, -1:]).sum(axis=1)
    return (
        weight.sum(axis=0),
        drawn,
        1.0 / (weight**2).sum(axis=1),
        p * np.exp(-largest[:, 0]) / total,
        largest[:, 0] + np.log(total),
    )
