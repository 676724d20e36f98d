"""Where a recording lies: at the prior's bounds, and in the whitened space of the features S(.).

For a single recording, the maximum mean discrepancy between it and the prior predictive is a function of the
kernel density at the recording: a two-sample test of one against many. Its power grows with more
recordings of a subject; its null with one is exact all the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import pdist
from scipy.stats import norm
from sklearn.decomposition import PCA
from sklearn.metrics.pairwise import rbf_kernel
from sklearn.neighbors import NearestNeighbors
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from swesbi.prior import BoxPrior, ParameterPrior, bounds

FloatArray = NDArray[np.float64]
BOUNDS: Final = ("lower", "upper")
LEAST_RATIO: Final = 1e-3  # no draw in any strip: as far from the bounds as can be told
LEAST_PRIOR_MASS: Final = 1e-12
KERNEL_POINTS: Final = 1000  # reference points of the kernel; its sums grow with their square


def strip_edges(prior: BoxPrior, strip_fraction: float) -> tuple[FloatArray, FloatArray]:
    """Return where the lower strips end and the upper ones begin; shape (d,) each."""
    low, high = bounds(prior)
    width = strip_fraction * (high - low)
    return low + width, high - width


def strip_mass(phi: FloatArray, weight: FloatArray, prior: BoxPrior, strip_fraction: float) -> FloatArray:
    """Return the mass of weighted draws (n, d) in the strip at each bound; shape (d, 2), lower then upper."""
    lower, upper = strip_edges(prior, strip_fraction)
    return np.stack([weight @ (phi < lower), weight @ (phi > upper)], axis=1)


def prior_strip_mass(prior: BoxPrior, strip_fraction: float) -> FloatArray:
    """Return the prior's mass in the strip at each bound; shape (d, 2), lower then upper."""
    lower, upper = strip_edges(prior, strip_fraction)
    parts = zip(prior.parameters, lower, upper, strict=True)
    return np.array([[_mass(p, p.low, edge), _mass(p, top, p.high)] for p, edge, top in parts])


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
    below = norm.cdf((ends - np.log(parameter.centre)) / parameter.log_sd)
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
        kernel = rbf_kernel(self.whiten(features), self.points, gamma=self.kernel_gamma)
        return np.asarray(1.0 - 2.0 * kernel.mean(axis=1) + self.kernel_mean)


def fit_feature_space(reference: FloatArray, whitened_variance: float, neighbours: int) -> FeatureSpace:
    """Whiten reference features (n, F), keeping the principal components of this share of the variance.

    What is left out is directions in which the features, made of fewer speeds, cannot move.
    """
    whitening = make_pipeline(
        StandardScaler(), PCA(n_components=whitened_variance, whiten=True, svd_solver="full")
    )
    white = np.asarray(whitening.fit_transform(reference), dtype=np.float64)
    points = white[:KERNEL_POINTS]
    distances = pdist(points)
    gamma = 0.5 / float(np.median(distances)) ** 2
    index = NearestNeighbors(n_neighbors=min(neighbours, len(white))).fit(white)
    return FeatureSpace(whitening, index, points, gamma, float(np.exp(-gamma * distances**2).mean()))
