"""What has changed between two visits: ratios of the later to the earlier, and what a protocol can detect.

A quantity has changed where the posterior probability of log ratio > log(1 + t), or that of log ratio <
-log(1 + t), is above P, t and P being settings. Both directions together do not count: a posterior that is
wide enough lies beyond the threshold on either side, and tells no change. Where the posterior of the log
ratio is normal, N(m, s^2), the rule is |m| > log(1 + t) + z_P s. Recordings repeated at a true log ratio D
scatter m about it by s at most, so that a change is called with probability B or more from
D = log(1 + t) + (z_P + z_B) s on: exp(D) - 1 is the smallest detectable change.

Can two recordings be of one person? What they share is compared with what two visits of one would. In normal
scores a recording's own posterior has mean m and covariance C under the prior N(0, I), and where all is
normal m is by itself N(0, I - C). Of two visits of one person the means have the covariance

    cov(m_1, m_2) = (I - C_1) diag(rho) (I - C_2),

of two persons none. The log ratio of the two densities of (m_1, m_2) is the most powerful test of one person
against two (Neyman and Pearson 1933). It is the normal approximation of the log Bayes factor
log Z_12 - log Z_1 - log Z_2, which is reported beside it. Its null distribution is drawn: pairs of one person
with these C and shares; the level is the share of them that the test takes for two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from scipy.special import ndtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray
from swesbi.draws import equal_weights, interval_levels, median_and_interval
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.shared_error import normal_log_density
from swesbi.parameters import OF_THETA, PEAK_ACTIVE, THETA, THETA_NAMES
from swesbi.persons.settings import ChangeRuleSettings
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.space import normal_scores
from swesbi.prior import BoxPrior

QUANTITIES: Final = (*THETA_NAMES, PEAK_ACTIVE.name)
"""What is compared: theta, and the largest active stiffness that elastography shows of the beat."""
UNITS: Final = tuple(parameter.cf_unit for parameter in THETA) + ("kPa",)
WORDS: Final = (*(f"{each.meaning} {each.text}" for each in THETA), "peak active stiffness")
"""What sheets and figures call them."""
LEAST_VARIANCE = 1e-4  # of a normal score; nothing measured is known better
LEAST_INFORMATION = 1e-3
"""Share of a score's prior variance below which a recording says nothing of it."""


@dataclass(frozen=True)
class Ratios:
    """Ratios of the later visit to the earlier, by quantity in the order of ``QUANTITIES``; (4,) each."""

    median: Annotated[FloatArray, Variable("", "1", "posterior median of the ratio, later to earlier")]
    low: Annotated[FloatArray, Variable("", "1", "lower end of its credible interval")]
    high: Annotated[FloatArray, Variable("", "1", "upper end of its credible interval")]
    rise: Annotated[FloatArray, Variable("", "1", "probability of a ratio above 1")]
    risen: Annotated[FloatArray, Variable("", "1", "probability of a rise beyond the threshold")]
    fallen: Annotated[FloatArray, Variable("", "1", "probability of a fall beyond the threshold")]
    sd_log: Annotated[FloatArray, Variable("", "1", "posterior standard deviation of the log ratio")]
    detectable: Annotated[
        FloatArray, Variable("", "1", "smallest change that the protocol can detect, as a fraction")
    ]
    narrowing: Annotated[
        FloatArray,
        Variable(
            "", "1", "by how much the interval of the log ratio is narrower than by independent posteriors"
        ),
    ]

    @property
    def changed(self) -> FloatArray:
        """Probability of a change beyond the threshold, up or down; shape (4,)."""
        return self.risen + self.fallen

    @property
    def one_way(self) -> FloatArray:
        """Probability of a change beyond the threshold in its likelier direction; shape (4,)."""
        return np.maximum(self.risen, self.fallen)


def quantities_of(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return what ``QUANTITIES`` names of phi (n, d), by simulation; NaN where there is no beat; (n, 4)."""
    _, peak_active_kpa = model.parts(phi, model.simulate(phi))
    return np.column_stack([phi[:, OF_THETA], peak_active_kpa.max(axis=1)])


def log_ratios(values: Sequence[FloatArray]) -> FloatArray:
    """Return log later / earlier of the quantities (n, 4) of two visits, without draws that have no beat.

    Raises ValueError where no draw has a beat at both visits.
    """
    ratio = np.log(values[1]) - np.log(values[0])
    known = np.isfinite(ratio).all(axis=1)
    if not known.any():
        raise ValueError("no draw of the posterior has a periodic beat at both visits; check the contexts")
    return np.asarray(ratio[known])


def summarise_ratios(
    joint: FloatArray, independent: FloatArray, mass: float, rule: ChangeRuleSettings
) -> Ratios:
    """Summarise draws of the log ratios: joint ones (n, 4), beside visits paired at random (m, 4)."""
    low, median, high = median_and_interval(joint, mass)
    beyond = np.log1p(rule.threshold)
    sd = joint.std(axis=0)
    alone = np.quantile(independent, interval_levels(mass), axis=0)
    return Ratios(
        median=np.exp(median),
        low=np.exp(low),
        high=np.exp(high),
        rise=(joint > 0.0).mean(axis=0),
        risen=(joint > beyond).mean(axis=0),
        fallen=(joint < -beyond).mean(axis=0),
        sd_log=sd,
        detectable=smallest_detectable(sd, rule),
        narrowing=1.0 - (high - low) / (alone[1] - alone[0]),
    )


def smallest_detectable(sd: FloatArray, rule: ChangeRuleSettings) -> FloatArray:
    """Return the smallest change, as a fraction, that is called one with the rule's power.

    ``sd`` are posterior standard deviations of log ratios.
    """
    reach = ndtri(rule.probability) + ndtri(rule.power)
    return np.asarray(np.expm1(np.log1p(rule.threshold) + reach * sd))


@dataclass(frozen=True)
class NormalVisit:
    """What one recording says by itself, as a normal posterior N(m, C) of scores whose prior is N(0, I).

    A recording adds no width, so eigenvalues of C are at most 1; shapes are (d,) and (d, d).
    """

    mean: FloatArray
    covariance: FloatArray
    effective_draws: float


def normal_visit(exact: ExactPosterior, prior: BoxPrior) -> NormalVisit:
    """Return the normal approximation of a visit's own posterior."""
    scores = normal_scores(exact.phi, prior)
    weight = equal_weights(len(scores))
    mean = weight @ scores
    spread, axes = np.linalg.eigh((scores - mean).T @ ((scores - mean) * weight[:, None]))
    covariance = (axes * np.clip(spread, LEAST_VARIANCE, 1.0)) @ axes.T
    effective = exact.effective_draws.min() if exact.by_mcmc else exact.efficiency * len(exact.weighted.phi)
    return NormalVisit(mean, covariance, float(min(effective, len(exact.phi))))


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
    """Test that two recordings are of one person, by so many simulated pairs.

    Where all shares (d,) are zero nothing can be told, and nothing is flagged. The Bayes factor is reported
    only.
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
    unit = np.eye(len(shares))
    told = [unit - visit.covariance for visit in visits]
    own = [
        each + visit.covariance / visit.effective_draws + LEAST_INFORMATION * unit
        for each, visit in zip(told, visits, strict=True)
    ]
    cross, nothing = told[0] @ np.diag(shares) @ told[1], np.zeros_like(told[0])
    one = np.block([[own[0], cross], [cross.T, own[1]]])
    return one, np.block([[own[0], nothing], [nothing, own[1]]])


def _log_normal(values: FloatArray, root: FloatArray) -> FloatArray:
    z = np.asarray(np.linalg.solve(root, values.T).T)
    return np.asarray(normal_log_density(z, np.log(np.diag(root))).sum(axis=1))
