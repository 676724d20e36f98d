"""Distances in the whitened space of the features S(.): is a recording where the prior predictive lies?

With one recording, the maximum mean discrepancy between it and the prior predictive is a function of the
kernel density at the recording: a two-sample test of one against many. Its power grows with more
recordings of a subject; its null with one is exact all the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import pdist
from sklearn.decomposition import PCA
from sklearn.metrics.pairwise import rbf_kernel
from sklearn.neighbors import NearestNeighbors
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

FloatArray = NDArray[np.float64]
KERNEL_POINTS: Final = 1000  # reference points of the kernel; its sums grow with their square


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
