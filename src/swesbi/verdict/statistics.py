"""What the tests look at in a recording, where it lies among simulated ones, and the statistic of each test.

For a single recording, the maximum mean discrepancy between it and the prior predictive is a function of the
kernel density at the recording: a two-sample test of one against many. Its power grows with more
recordings of a subject; its null with one is exact all the same.

Replicated recordings carry the noise and the discrepancy of the observation model and pass the operator
S(.) as the recording does (Gelman, Meng and Stern, Statistica Sinica 6:733, 1996).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, NamedTuple

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel, draw_speeds, residuals
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording
from swesbi.networks.flow.conditioning import ConditioningSettings, raw_features
from swesbi.parameters import PHI_NAMES
from swesbi.prior import JointPriorSettings, ParameterPrior, SomeParameters, quantile

if TYPE_CHECKING:  # scikit-learn takes a third of a second to import
    from sklearn.neighbors import NearestNeighbors
    from sklearn.pipeline import Pipeline


BOUNDS: Final = ("lower", "upper")


LEAST_RATIO: Final = 1e-3  # no draw in any strip: as far from the bounds as can be told


LEAST_PRIOR_MASS: Final = 1e-12


KERNEL_POINTS: Final = 1000  # reference points of the kernel; its sums grow with their square


IN_LOG: Final = ("length_dependence", "passive_ratio")
"""Nuisance parameters that have strips as well, in the logarithm: a heart of other bonds, or of another wall
than any within the prior, presses on their bounds. A strip in the value would contain nearly all of it."""
WITH_STRIPS: Final = (*PHI_NAMES, *IN_LOG)
"""Parameters with a strip at each bound."""
LOG_STRIP_MASS: Final = 0.04  # of the prior at most, so that a posterior within the strip is evidence


def strip_edges(prior: JointPriorSettings, strip_fraction: float) -> tuple[FloatArray, FloatArray]:
    """Return where the lower strips end and the upper ones begin, of ``WITH_STRIPS``, (6,) each.

    What is reported has strips of this share of the box. Those of ``IN_LOG`` have this share of the box in
    the logarithm, and at most ``LOG_STRIP_MASS`` of the prior. NaN where a parameter is fixed.
    """
    edges = [
        (np.nan, np.nan) if parameter is None else _edges(parameter, name in IN_LOG, strip_fraction)
        for name, parameter in zip(WITH_STRIPS, _bounded(prior), strict=True)
    ]
    lower, upper = np.array(edges).T
    return lower, upper


def strip_mass(
    phi: FloatArray, weight: FloatArray, prior: JointPriorSettings, strip_fraction: float
) -> FloatArray:
    """Return the mass of weighted draws (n, d) in each strip of ``WITH_STRIPS``; 0 of what is fixed.

    Returns:
        Shape (6, 2), lower then upper.
    """
    columns = [prior.column(phi, name) for name in WITH_STRIPS]
    masses = [
        (0.0, 0.0) if column is None else (weight @ (column < lower), weight @ (column > upper))
        for column, lower, upper in zip(columns, *strip_edges(prior, strip_fraction), strict=True)
    ]
    return np.array(masses, dtype=np.float64)


def prior_strip_mass(prior: JointPriorSettings, strip_fraction: float) -> FloatArray:
    """Return the prior's mass in the strip at each bound of ``WITH_STRIPS``; 1 of what is fixed; (6, 2)."""
    lower, upper = strip_edges(prior, strip_fraction)
    return np.array(
        [
            (1.0, 1.0) if p is None else (_mass(p, p.low, edge), _mass(p, top, p.high))
            for p, edge, top in zip(_bounded(prior), lower, upper, strict=True)
        ]
    )


def _bounded(prior: JointPriorSettings) -> tuple[ParameterPrior | None, ...]:
    of_name = dict(zip(prior.names, prior.parameters, strict=True))
    return tuple(of_name.get(name) for name in WITH_STRIPS)


def _edges(parameter: ParameterPrior, in_log: bool, strip_fraction: float) -> tuple[float, float]:
    low, high = parameter.low, parameter.high
    if not in_log:
        width = strip_fraction * (high - low)
        return low + width, high - width
    reach = (high / low) ** strip_fraction
    rare = quantile(np.array([[LOG_STRIP_MASS], [1.0 - LOG_STRIP_MASS]]), SomeParameters((parameter,)))[:, 0]
    return min(low * reach, float(rare[0])), max(high / reach, float(rare[1]))


def boundary_statistic(mass: FloatArray, prior_mass: FloatArray, level: float) -> FloatArray:
    """Return log10 of the largest ratio of posterior to prior mass over the strips; (n,) from (n, d, 2).

    Under the model a ratio has mean one, so it exceeds r in at most 1 of r recordings, whatever the
    strip (Markov). A strip that holds more than ``level`` of the prior can therefore never be evidence at
    that level, for its ratio stays below 1 / level; it is left out.
    """
    rare = prior_mass <= level
    ratio = strip_ratios(mass, prior_mass)[:, rare]
    return np.asarray(np.log10(ratio.max(axis=1, initial=LEAST_RATIO)))


def strip_ratios(mass: FloatArray, prior_mass: FloatArray) -> FloatArray:
    """Return posterior over prior mass in each strip, of any leading shape (..., d, 2)."""
    return np.asarray(mass / np.maximum(prior_mass, LEAST_PRIOR_MASS))


def _mass(parameter: ParameterPrior, start: float, stop: float) -> float:
    ends = np.log([start, stop, parameter.low, parameter.high])
    below = ndtr((ends - np.log(parameter.centre)) / parameter.log_sd)
    return float((below[1] - below[0]) / (below[3] - below[2]))


@dataclass(frozen=True)
class FeatureSpace:
    """The whitened features of reference recordings from the prior predictive.

    Attributes:
        whitening: Standardisation and principal components of unit variance.
        neighbours: Index of the whitened reference recordings.
        points: The first of them, for the kernel; shape (m, d).
        kernel_gamma: 1 / (2 bandwidth^2), the bandwidth being the median distance of the points.
        kernel_mean: Mean kernel between different points.
    """

    whitening: Pipeline
    neighbours: NearestNeighbors
    points: FloatArray
    kernel_gamma: float
    kernel_mean: float

    def whiten(self, features: FloatArray) -> FloatArray:
        """Return the whitened features (n, d) of raw ones (n, F)."""
        return np.asarray(self.whitening.transform(features), dtype=np.float64)

    def mahalanobis(self, features: FloatArray) -> FloatArray:
        """Return the Mahalanobis distance of each recording from the reference mean; shape (n,)."""
        return np.asarray(np.sqrt((self.whiten(features) ** 2).sum(axis=1)))

    def nearest(self, features: FloatArray) -> FloatArray:
        """Return the mean distance of each recording to its k nearest reference recordings; shape (n,)."""
        distances, _ = self.neighbours.kneighbors(self.whiten(features))
        return np.asarray(distances.mean(axis=1))

    def discrepancy(self, features: FloatArray) -> FloatArray:
        """Return the squared maximum mean discrepancy of each single recording; shape (n,).

        MMD^2 = k(x, x) - 2 mean_i k(x, x_i) + mean_{i != j} k(x_i, x_j), Gaussian k (Gretton et al. 2012).
        """
        from sklearn.metrics.pairwise import rbf_kernel

        kernel = rbf_kernel(self.whiten(features), self.points, gamma=self.kernel_gamma)
        return np.asarray(1.0 - 2.0 * kernel.mean(axis=1) + self.kernel_mean)


def fit_feature_space(reference: FloatArray, whitened_variance: float, neighbours: int) -> FeatureSpace:
    """Whiten reference features (n, F), keeping the principal components of this share of the variance.

    What is left out is directions in which the features, made of fewer speeds, cannot move.
    """
    from scipy.spatial.distance import pdist
    from sklearn.decomposition import PCA
    from sklearn.neighbors import NearestNeighbors
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    whitening = make_pipeline(
        StandardScaler(), PCA(n_components=whitened_variance, whiten=True, svd_solver="full")
    )
    white = np.asarray(whitening.fit_transform(reference), dtype=np.float64)
    points = white[:KERNEL_POINTS]
    distances = pdist(points)
    gamma = 0.5 / float(np.median(distances)) ** 2
    index = NearestNeighbors(n_neighbors=min(neighbours, len(white))).fit(white)
    return FeatureSpace(whitening, index, points, gamma, float(np.exp(-gamma * distances**2).mean()))


LEAST_TAIL: Final = 1e-3  # what some hundred weighted draws can resolve


FEATURE_UNITS: Final = "log of kPa, or 1"


PREDICTED: Final = "prior predictive"


FITTED: Final = "fit"


BOUNDED: Final = "bounds"


GROUPS: Final = (PREDICTED, FITTED, BOUNDED)
"""Three questions: can the prior make such a recording, does the posterior, does it press on a bound?"""


FEATURE_TESTS: Final = {
    "peak": "maximum_kpa",
    "time_to_peak": "time_to_peak_cycle",
    "decay": "decay_slope_kpa_per_cycle",
}


def chi2_p_value(
    predicted: PredictedSpeeds, recording: SpeedRecording, discrepancy: DiscrepancySettings
) -> float:
    """Return the posterior predictive p-value of chi2 = sum z^2 over the p measured phases.

    At given phi the replicated z are independent standard normals, also where phases share errors, so chi2
    has p degrees of freedom: its tail probability is known and is averaged over the posterior.
    """
    z = residuals(predicted, recording, discrepancy)
    return float(chdtrc(z.shape[1], (z**2).sum(axis=1)).mean())


def tail_probabilities(observed: FloatArray, replicated: FloatArray) -> FloatArray:
    """Return the predictive probability of a smaller value than the observed one, ties by half; (F,).

    Args:
        observed: Features of the recording; shape (F,).
        replicated: Features of replicated recordings; shape (m, F).
    """
    below = (replicated < observed) + 0.5 * (replicated == observed)
    return np.asarray(below.mean(axis=0))


def tail_scores(tails: FloatArray) -> FloatArray:
    """Return the size of each tail probability's normal score, of any shape; 0 in the middle."""
    return np.asarray(np.abs(ndtri(np.clip(tails, LEAST_TAIL, 1.0 - LEAST_TAIL))))


def misfit_score(p_value: FloatArray) -> FloatArray:
    """Return the normal score of p-values of squared residuals, large where the misfit is; any shape."""
    return np.asarray(-ndtri(np.clip(p_value, LEAST_TAIL**2, 1.0 - LEAST_TAIL)))


class MisfitTest(NamedTuple):
    """A test with a null distribution: its name, what it asks, and the group that it belongs to."""

    name: str
    group: str
    meaning: str


TESTS: Final = (
    MisfitTest("mahalanobis", PREDICTED, "Mahalanobis distance of the features from the prior predictive"),
    MisfitTest("nearest_neighbours", PREDICTED, "distance of the features to the nearest simulations"),
    MisfitTest("mmd", PREDICTED, "kernel two-sample discrepancy of the features (MMD)"),
    MisfitTest("chi2", FITTED, "sum of squared standardised residuals"),
    MisfitTest("peak", FITTED, "peak stiffness"),
    MisfitTest("time_to_peak", FITTED, "time to peak"),
    MisfitTest("decay", FITTED, "post-peak decay slope"),
    MisfitTest("conditional_features", FITTED, "most unlikely feature given the recording"),
    MisfitTest("boundary_mass", BOUNDED, "posterior mass at a bound of the prior"),
)


TEST_NAMES: Final = tuple(test.name for test in TESTS)


MEMBERS: Final = tuple(
    tuple(index for index, test in enumerate(TESTS) if test.group == group) for group in GROUPS
)


DISTANCES: Final = tuple(test.name for test in TESTS if test.group == PREDICTED)
"""The tests that ask only where the features lie among those of the prior predictive."""


@dataclass(frozen=True)
class PosteriorDraws:
    """Weighted draws of one recording's exact posterior, and what they predict.

    Attributes:
        phi: Draws; shape (n, d).
        weight: Their weights, which sum to one; shape (n,).
        predicted: Noiseless log speeds and slopes of equally weighted draws; (m, p) each.
        k_hat: Pareto shape of the weights; NaN where they are equal.
        efficiency: Effective share of the draws.
    """

    phi: FloatArray
    weight: FloatArray
    predicted: PredictedSpeeds
    k_hat: float
    efficiency: float


@dataclass(frozen=True)
class Checks:
    """What the tests look at in n recordings; the features are not standardised."""

    features: Annotated[FloatArray, Variable("recording feature", FEATURE_UNITS, "{features}")]
    tails: Annotated[
        FloatArray, Variable("recording feature", "1", "predictive probability of a smaller value")
    ]
    chi2_p: Annotated[FloatArray, Variable("recording", "1", "posterior predictive p-value of chi2")]
    bound_mass: Annotated[
        FloatArray, Variable("recording bounded bound", "1", "posterior mass in the strip{bound}")
    ]
    k_hat: Annotated[FloatArray, Variable("recording", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[FloatArray, Variable("recording", "1", "effective share of the weighted draws")]

    def __len__(self) -> int:
        return len(self.features)

    def chi2_score(self) -> FloatArray:
        """Return the normal score of chi2's p-value, large where the misfit is; shape (n,)."""
        return misfit_score(self.chi2_p)


def check_recording(
    model: SpeedModel,
    draws: PosteriorDraws,
    conditioning: ConditioningSettings,
    strip_fraction: float,
    rng: np.random.Generator,
) -> Checks:
    """Return what the tests look at in the recording of ``model``, as one row.

    Args:
        model: The recording and its model.
        draws: Its exact posterior.
        conditioning: How speeds become features.
        strip_fraction: Width of the strip at a bound, over the box's.
        rng: Stream of the replicated recordings.
    """
    recording, discrepancy = model.recording, model.settings.discrepancy
    speeds = draw_speeds(draws.predicted, recording.errors, discrepancy, rng)
    replicated = raw_features(speeds, recording.phase, conditioning)
    observed = raw_features(recording.speed_m_s[None], recording.phase, conditioning)
    return Checks(
        features=observed,
        tails=tail_probabilities(observed[0], replicated)[None],
        chi2_p=np.array([chi2_p_value(draws.predicted, recording, discrepancy)]),
        bound_mass=strip_mass(draws.phi, draws.weight, model.settings.prior, strip_fraction)[None],
        k_hat=np.array([draws.k_hat]),
        efficiency=np.array([draws.efficiency]),
    )


def no_checks(features: int) -> Checks:
    """Return the checks of no recording, with F features."""
    empty = np.empty(0)
    nothing = np.empty((0, features))
    return Checks(nothing, nothing, empty, np.empty((0, len(WITH_STRIPS), 2)), empty, empty)
