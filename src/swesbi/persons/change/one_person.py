"""Can two recordings be of one person? What they share is compared with what two visits of one would.

In normal scores a recording's own posterior has mean m and covariance C under the prior N(0, I), and where
all is normal m is by itself N(0, I - C). Of two visits of one person the means have the covariance

    cov(m_1, m_2) = (I - C_1) diag(rho) (I - C_2),

of two persons none. The log ratio of the two densities of (m_1, m_2) is the most powerful test of one person
against two (Neyman and Pearson 1933). It is the normal approximation of the log Bayes factor
log Z_12 - log Z_1 - log Z_2, which is reported beside it. Its null distribution is drawn: pairs of one person
with these C and shares; the level is the share of them that the test takes for two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray
from swesbi.draws import equal_weights
from swesbi.measurement.shared_error import normal_log_density
from swesbi.posterior.space import normal_scores
from swesbi.prior import BoxPrior

LEAST_VARIANCE = 1e-4  # of a normal score; nothing measured is known better
LEAST_INFORMATION = 1e-3
"""Share of a score's prior variance below which a recording says nothing of it."""


@dataclass(frozen=True)
class NormalVisit:
    """What one recording says by itself, as a normal posterior N(m, C) of scores whose prior is N(0, I).

    Attributes:
        mean: m; shape (d,).
        covariance: C; a recording adds no width, so its eigenvalues are at most 1; shape (d, d).
        effective_draws: Behind both.
    """

    mean: FloatArray
    covariance: FloatArray
    effective_draws: float


def normal_visit(phi: FloatArray, prior: BoxPrior, effective_draws: float) -> NormalVisit:
    """Return the normal approximation of a visit's own posterior.

    Args:
        phi: Equally weighted draws; shape (m, d).
        prior: Of one visit.
        effective_draws: Behind the draws.
    """
    scores = normal_scores(phi, prior)
    weight = equal_weights(len(scores))
    mean = weight @ scores
    spread, axes = np.linalg.eigh((scores - mean).T @ ((scores - mean) * weight[:, None]))
    held = np.clip(spread, LEAST_VARIANCE, 1.0)
    return NormalVisit(mean, (axes * held) @ axes.T, effective_draws)


@dataclass(frozen=True)
class OnePerson:
    """Whether two recordings can be of one person."""

    log_bayes_factor: Annotated[float, Variable("", "1", "log Bayes factor of one person against two")]
    log_ratio: Annotated[float, Variable("", "1", "its normal approximation, the statistic of the test")]
    p_value: Annotated[float, Variable("", "1", "share of pairs of one person with as small a statistic")]
    level: Annotated[float, Variable("", "1", "of the test that both recordings are of one person")]
    distance: Annotated[
        float, Variable("", "1", "distance in shared parameters, in posterior standard deviations")
    ]

    @property
    def flagged(self) -> bool:
        """Whether the pair is taken for two persons."""
        return self.p_value <= self.level


def judge_one_person(
    visits: Sequence[NormalVisit],
    shares: FloatArray,
    log_bayes_factor: float,
    level: float,
    draws: int,
    rng: np.random.Generator,
) -> OnePerson:
    """Test that two recordings are of one person.

    Args:
        visits: What each says by itself.
        shares: Of each parameter; shape (d,). Where all are zero nothing can be told, and nothing is flagged.
        log_bayes_factor: From the evidences; it is reported.
        level: Of the test.
        draws: Simulated pairs of one person.
        rng: Their source.
    """
    one, two = _covariances(visits, shares)
    means = np.concatenate([visit.mean for visit in visits])
    roots = [np.asarray(np.linalg.cholesky(covariance)) for covariance in (one, two)]
    null = rng.standard_normal((draws, len(means))) @ roots[0].T
    (observed,), simulated = (
        _log_normal(x, roots[0]) - _log_normal(x, roots[1]) for x in (means[None], null)
    )
    tied = np.flatnonzero(shares)
    p_value = (1.0 + (simulated <= observed).sum()) / (1.0 + draws) if len(tied) else 1.0
    return OnePerson(float(log_bayes_factor), float(observed), float(p_value), level, _distance(visits, tied))


def _distance(visits: Sequence[NormalVisit], tied: np.ndarray) -> float:
    """Return the distance of two posteriors in the parameters ``tied``, in posterior standard deviations.

    Mahalanobis's, by the sum of both covariances; 0 where nothing is tied.
    """
    if not len(tied):
        return 0.0
    apart = (visits[1].mean - visits[0].mean)[tied]
    covariance = sum(visit.covariance[np.ix_(tied, tied)] for visit in visits)
    return float(np.sqrt(apart @ np.linalg.solve(covariance, apart)))


def _covariances(visits: Sequence[NormalVisit], shares: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of both means, of one person and of two; (2 d, 2 d) each."""
    told = [np.eye(len(shares)) - visit.covariance for visit in visits]
    noise = [visit.covariance / visit.effective_draws for visit in visits]
    cross, nothing = told[0] @ np.diag(shares) @ told[1], np.zeros_like(told[0])
    own = [
        each + error + LEAST_INFORMATION * np.eye(len(shares))
        for each, error in zip(told, noise, strict=True)
    ]
    one = np.block([[own[0], cross], [cross.T, own[1]]])
    return one, np.block([[own[0], nothing], [nothing, own[1]]])


def _log_normal(values: FloatArray, root: FloatArray) -> FloatArray:
    z = np.asarray(np.linalg.solve(root, values.T).T)
    return np.asarray(normal_log_density(z, np.log(np.diag(root))).sum(axis=1))
