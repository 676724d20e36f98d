"""A linear-Gaussian stand-in with a known posterior: x = log(phi / centre) / log_sd, data A x + noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.base.arrays import below_each_other
from swesbi.checks.calibration.ranks import (
    QUANTITY_NAMES,
    WEIGHTED,
    RankedRecordings,
    RankScores,
    quantities,
    rank,
    reference_points,
)
from swesbi.checks.calibration.table import judge, long_table
from swesbi.checks.settings import JudgementSettings
from swesbi.draws import equal_weights
from swesbi.prior import JointPriorSettings

FloatArray = NDArray[np.float64]
CENTRE = np.array([45.0, 5.0, 30.0, 2.2])
LOG_SD = np.array([0.5, 0.6, 0.45, 0.4])
NOISE_SD = 0.4
DURATION_S = 0.32
MIXING = np.array(
    [
        [1.0, 0.8, 0.0, 0.2],
        [0.6, 1.0, -0.3, 0.0],
        [0.2, 0.0, 1.0, 0.0],
        [0.0, 0.3, 0.5, 1.0],
        [0.5, 0.5, 0.5, 0.5],
    ]
)
REACH = np.exp(6.0 * LOG_SD)
PARTS = {"centre": CENTRE, "log_sd": LOG_SD, "low": CENTRE / REACH, "high": CENTRE * REACH}
K_0, K_ATP, K_SR, PASSIVE = ({name: float(part[j]) for name, part in PARTS.items()} for j in range(4))
PRIOR = JointPriorSettings.from_plain(
    {
        "theta": {"k0_kpa": K_0, "k_atp_per_s": K_ATP, "k_sr_per_s": K_SR},
        "passive_stiffness_kpa": PASSIVE,
    }
)
JUDGEMENT = JudgementSettings(
    alpha=0.05, least_contraction=0.2, max_c2st=0.53, nominal_levels=(0.5, 0.9), confidence=0.95
)


def checks_of(
    scores: RankScores,
    prior_variance: FloatArray | None = None,
    names: Sequence[str] = QUANTITY_NAMES,
    kind: str = "model_noise",
) -> pd.DataFrame:
    """Return the checks of recordings of one subject under one sampler."""
    count = len(scores.tarp)
    variance = prior_variances(count) if prior_variance is None else prior_variance
    truth = np.ones((count, len(names)))
    ranked = RankedRecordings(tuple(names), np.full(count, "A"), truth, variance, scores, scores)
    rows = long_table({kind: ranked})
    return judge(rows[rows["sampler"] == WEIGHTED], JUDGEMENT)


def flagged(checks: pd.DataFrame, *tests: str) -> set[str]:
    """Return the quantities that checks of these tests flag; all tests where none is named."""
    chosen = checks["flagged"].astype(bool) & (checks["test"].isin(tests) if tests else True)
    return set(checks.loc[chosen, "quantity"])


def phi_of(x: FloatArray) -> FloatArray:
    return np.asarray(CENTRE * np.exp(LOG_SD * x))


@dataclass(frozen=True)
class Sampler:
    """A posterior sampler: right by default, wrong in the ways that the fields say."""

    noise_factor: float = 1.0
    times_used: int = 1
    data_used: bool = True
    shift: float = 0.0

    def draw(self, y: FloatArray, draws: int, rng: np.random.Generator) -> FloatArray:
        """Return x of shape (draws, 4)."""
        if not self.data_used:
            return rng.standard_normal((draws, 4))
        weight = self.times_used * MIXING.T / (self.noise_factor * NOISE_SD) ** 2
        covariance = np.linalg.inv(weight @ MIXING + np.eye(4))
        centre = covariance @ weight @ y + self.shift * np.sqrt(np.diag(covariance))
        return np.asarray(rng.multivariate_normal(centre, covariance, draws, method="cholesky"))


def quantities_of(x: FloatArray, y: FloatArray) -> FloatArray:
    log_likelihood = -0.5 * (((y - x @ MIXING.T) / NOISE_SD) ** 2).sum(axis=1)
    return quantities(phi_of(x), log_likelihood, DURATION_S)


def prior_variances(recordings: int) -> FloatArray:
    """Variances by simulation, shape (recordings, 6)."""
    x = np.random.default_rng(5).standard_normal((200_000, 4))
    variance = quantities(phi_of(x), np.zeros(len(x)), DURATION_S).var(axis=0)
    return np.tile([*variance[:-1], np.nan], (recordings, 1))


def simulate(recordings: int, sampler: Sampler, draws: int = 199, seed: int = 1) -> RankScores:
    """Score a sampler on fresh recordings; the recordings are the same for every sampler."""
    rng = np.random.default_rng(seed)
    truth = rng.standard_normal((recordings, 4))
    data = truth @ MIXING.T + NOISE_SD * rng.standard_normal((recordings, len(MIXING)))
    references = reference_points(recordings, PRIOR, rng)
    scores = []
    for x, y, reference in zip(truth, data, references, strict=True):
        drawn = quantities_of(sampler.draw(y, draws, rng), y)
        known = quantities_of(x[None], y)[0]
        scores.append(rank(known, drawn, equal_weights(draws), reference, PRIOR))
    return below_each_other(scores)
