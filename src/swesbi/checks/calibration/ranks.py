"""Ranks and levels of the truth among a posterior's weighted draws, and the test that they are uniform.

Joint coverage (TARP): Lemos, Coogan, Hezaveh and Perreault-Levasseur (2023), Sampling-based accuracy testing
of posterior estimators for general inference, ICML. The function of sbi takes its own posterior objects and
equally weighted draws; the one here takes arrays with weights.

The test and its simultaneous band: Säilynoja, Bürkner and Vehtari (2022), Graphical test for discrete
uniformity and its applications in goodness-of-fit evaluation and multiple sample comparison, Stat. Comput.
32:32. ArviZ computes the same bands, but no p-values, which a table of many tests needs; the band here comes
from the same null distribution as the p-value, so that a curve leaves the band exactly where its p-value is
below the limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, bdtrc

from swesbi.artefacts import Labels, Part, Variable
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.draws import effective_draws
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import ISOMETRIC, OF_INTEREST, PHI_NAMES
from swesbi.prior import BoxPrior, JointPriorSettings, log_centre, quantile, spread_points
from swesbi.prior import prior_variance as prior_variance_of
from swesbi.seeds import generator

LOG_LIKELIHOOD: Final = "log_likelihood"
QUANTITY_NAMES: Final = (*PHI_NAMES, ISOMETRIC, LOG_LIKELIHOOD)
EACH: Final = "as named in quantity"
NETWORK: Final = "proposal"
WEIGHTED: Final = "weighted"
SAMPLERS: Final = (NETWORK, WEIGHTED)


@dataclass(frozen=True)
class RankScores:
    """The posteriors of n recordings under one sampler, each against its truth."""

    level: Annotated[
        FloatArray, Variable("recording quantity", "1", "mid-rank of the truth among the draws of {sampler}")
    ]
    tarp: Annotated[
        FloatArray, Variable("recording", "1", "mass of {sampler} nearer to a random point than the truth")
    ]
    mean: Annotated[FloatArray, Variable("recording quantity", EACH, "mean of {sampler}")]
    sd: Annotated[FloatArray, Variable("recording quantity", EACH, "standard deviation of {sampler}")]
    effective_draws: Annotated[FloatArray, Variable("recording", "1", "effective draws of {sampler}")]


@dataclass(frozen=True)
class RankedRecordings:
    """n recordings, q quantities, with the context and protocol of ``subject``; no prior variance is NaN."""

    names: Annotated[tuple[str, ...], Labels("quantity")]
    subject: Annotated[NDArray[np.str_], Labels("recording", "subject")]
    truth: Annotated[FloatArray, Variable("recording quantity", EACH, "true value")]
    prior_variance: Annotated[
        FloatArray, Variable("recording quantity", f"{EACH}, squared", "before the recording is seen")
    ]
    network: Annotated[RankScores, Part("proposal_{}", words={"sampler": "the network"})]
    weighted: Annotated[RankScores, Part("weighted_{}", words={"sampler": "the exact posterior"})]

    def of(self, sampler: str) -> RankScores:
        """Return the scores of a sampler of ``SAMPLERS``."""
        return {NETWORK: self.network, WEIGHTED: self.weighted}[sampler]


def level_of_truth(truth: FloatArray, draws: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the mid-rank of the truth (q,) among draws (n, q) as a level in (0, 1); shape (q,).

    For L equal weights the truth's rank r among the draws is uniform on 0..L if the posterior is right
    (Talts et al. 2018, Validating Bayesian inference algorithms with simulation-based calibration), and the
    level is (r + 1/2) / (L + 1). For unequal normalised weights (n,) r is L times the weight below the truth,
    with L the effective number of draws. Ties count by half.
    """
    below = weight @ (draws < truth) + 0.5 * (weight @ (draws == truth))
    number = effective_draws(weight)
    return np.asarray((number * below + 0.5) / (number + 1.0))


def central_level(level: FloatArray) -> FloatArray:
    """Return |2 u - 1| for levels u: the mass of the smallest central interval that contains the truth.

    Its distribution function at a nominal level is the coverage of the equal-tailed interval of that mass.
    """
    return np.abs(2.0 * level - 1.0)


def moments(draws: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weighted mean and sd (q,) of draws (n, q) that carry weight; others may hold anything.

    A quantity that is -inf in one of them, the log-likelihood of a simulation that failed, has mean -inf and
    standard deviation NaN.
    """
    used = weight > 0.0
    kept, share = draws[used], weight[used]
    mean = share @ kept
    with np.errstate(invalid="ignore"):  # -inf less -inf
        return mean, np.sqrt(share @ (kept - mean) ** 2)


def quantity_names(prior: JointPriorSettings) -> tuple[str, ...]:
    """Return the names of the quantities that are ranked: ``QUANTITY_NAMES``, then nuisance parameters."""
    return (*QUANTITY_NAMES, *prior.nuisance_names)


def quantities(phi: FloatArray, log_likelihood: FloatArray, duration_s: FloatArray | float) -> FloatArray:
    """Return the quantities of ``QUANTITY_NAMES``, then nuisance parameters, of draws (n, d); (n, d + 2).

    k_0 (1 - exp(-k_ATP D_T)), with D_T the duration of the activation of each draw or of all, is what the
    data know best of k_0 and k_ATP. The log-likelihood (n,) depends on the data, and so finds posteriors that
    are calibrated in every parameter without having seen them (Modrák et al. 2023, Simulation-based
    calibration checking for Bayesian computation: the choice of test quantities shapes sensitivity).
    """
    isometric = isometric_stiffness_kpa(phi, duration_s)
    return np.column_stack([phi[:, OF_INTEREST], isometric, log_likelihood, phi[:, OF_INTEREST.stop :]])


def prior_variance(model: SpeedModel) -> FloatArray:
    """Return the prior variance of each quantity; shape (d + 2,). The log-likelihood has none (NaN)."""
    prior = model.settings.prior
    phi, of_phi = spread_points(prior), prior_variance_of(prior)
    isometric = isometric_stiffness_kpa(phi, model.activation_duration_s(phi)).var()
    return np.array([*of_phi[OF_INTEREST], isometric, np.nan, *of_phi[OF_INTEREST.stop :]])


def standardised(phi: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return log(phi / centre) / log_sd of shape (..., d), in which distances are taken."""
    log_sd = np.array([parameter.log_sd for parameter in prior.parameters])
    return np.asarray(np.log(phi / log_centre(prior)) / log_sd)


def reference_points(count: int, prior: BoxPrior, rng: np.random.Generator) -> FloatArray:
    """Draw a reference point for each recording, from the prior and independent of everything; (count, d)."""
    return standardised(quantile(rng.random((count, len(prior.parameters))), prior), prior)


def tarp_level(
    truth: FloatArray, draws: FloatArray, weight: FloatArray, reference: FloatArray, prior: BoxPrior
) -> float:
    """Return the posterior mass nearer to the reference point than the truth; uniform if calibrated.

    True phi (d,) stands among draws (n, d) with normalised weights (n,); the point (d,) is standardised by
    the scales of the prior.
    """
    of_truth = np.linalg.norm(standardised(truth[None], prior) - reference, axis=1)
    of_draws = np.linalg.norm(standardised(draws, prior) - reference, axis=1)
    return float(level_of_truth(of_truth, of_draws[:, None], weight)[0])


def rank(
    truth: FloatArray, draws: FloatArray, weight: FloatArray, reference: FloatArray, prior: BoxPrior
) -> RankScores:
    """Rank one truth (q,) among the quantities of its draws (n, q) with normalised weights (n,); one row.

    Joint coverage is taken about the standardised reference point (d,), in the scales of the prior.
    """
    of_phi = [*range(OF_INTEREST.stop), *range(len(QUANTITY_NAMES), len(truth))]
    mean, sd = moments(draws, weight)
    tarp = tarp_level(truth[of_phi], draws[:, of_phi], weight, reference, prior)
    level, number = level_of_truth(truth, draws, weight), effective_draws(weight)
    return RankScores(level[None], np.array([tarp]), mean[None], sd[None], np.array([number]))


POINTS: Final = 100
"""Intervals between the points of evaluation; ranks among L draws fit them where L + 1 is a multiple."""
NULL_SAMPLES: Final = 10_000
NULL_SEED: Final = 2022


@dataclass(frozen=True)
class Uniformity:
    """The test of one sample: its distribution function less the uniform one at :func:`points`.

    ``distance`` is the largest absolute difference, ``p_value`` the probability that a uniform sample comes
    as near to leaving some band at some point.
    """

    difference: FloatArray
    distance: float
    p_value: float


def points() -> FloatArray:
    """Return where distribution functions are evaluated: the inner multiples of 1/POINTS."""
    return np.asarray(np.arange(1, POINTS) / POINTS)


def uniformity(sample: FloatArray) -> Uniformity:
    """Test a sample of levels in [0, 1], shape (n,), for uniformity.

    An empty sample, or one with NaN, is refused.
    """
    if not len(sample) or np.isnan(sample).any():
        raise ValueError(f"a test of uniformity needs levels without NaN, got {len(sample)} of them")
    counts = np.searchsorted(np.sort(sample), points(), side="right")
    tail = float(_smallest_tail(counts, len(sample)))
    null = _null_tails(len(sample))
    difference = counts / len(sample) - points()
    # the sample counts as one of the null's, so that no p-value is 0 and the test keeps its level
    p_value = (1.0 + np.searchsorted(null, tail, side="right")) / (1.0 + len(null))
    return Uniformity(difference, float(np.abs(difference).max()), float(p_value))


def band(n: int, level: float) -> tuple[FloatArray, FloatArray]:
    """Return the limits of the difference that a uniform sample of size n leaves with this probability.

    At each point they are quantiles of a binomial distribution, all at the same pointwise level, which is
    chosen such that the band holds at all points at once.
    """
    from scipy.stats import binom

    # a tail that the null has, not one between two: counts are discrete, and so are their tails
    pointwise = float(np.quantile(_null_tails(n), level, method="lower"))
    return (
        np.asarray(binom.ppf(pointwise / 2.0, n, points()) / n - points()),
        np.asarray(binom.isf(pointwise / 2.0, n, points()) / n - points()),
    )


def _smallest_tail(counts: IntArray, n: int) -> FloatArray:
    """Return twice the smallest binomial tail probability over the points, of counts (..., points)."""
    lower, upper = _tails(n)
    # neighbouring points hardly differ, so that Bonferroni over them would make bands far too wide: the null
    # distribution of the smallest tail takes their dependence into account
    at = np.arange(POINTS - 1)
    tails: FloatArray = np.minimum(lower[counts, at], upper[counts, at]).min(axis=-1)
    return 2.0 * tails


@lru_cache(maxsize=32)
def _tails(n: int) -> tuple[FloatArray, FloatArray]:
    """Return P(count <= k) and P(count >= k) for k = 0..n (rows) at each point (columns)."""
    k = np.arange(n + 1)[:, None]
    return np.asarray(bdtr(k, n, points())), np.asarray(bdtrc(k - 1, n, points()))


@lru_cache(maxsize=32)
def _null_tails(n: int) -> FloatArray:
    """Return the sorted smallest tails of uniform samples of size n; a fixed stream for each size."""
    rng = generator(NULL_SEED, "uniformity", n)
    # a distribution function is only seen at the points: the counts between them are multinomial
    counts = rng.multinomial(n, np.full(POINTS, 1.0 / POINTS), size=NULL_SAMPLES)
    return np.sort(_smallest_tail(counts.cumsum(axis=1)[:, :-1], n))
