"""Student distributions and mixtures of them, fitted to weighted draws: proposals with tails for weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import logsumexp
from scipy.stats import multivariate_t
from sklearn.mixture import GaussianMixture
from threadpoolctl import threadpool_limits

from swesbi.arrays import FloatArray
from swesbi.draws import effective_draws, normalised, resampled_rows

DEGREES_OF_FREEDOM: Final = 8  # heavier tails than a posterior's, so that weights stay bounded
WIDENING: Final = 1.2  # of the covariance
RIDGE: Final = 1e-4  # least variance of a proposal, in eta
DRAWS_A_PARAMETER: Final = 10.0  # effective ones behind a proposal; a posterior with fewer is flattened
MOST_COMPONENTS: Final = (
    4  # of a mixture: more of them fit fewer draws each, and lost on posteriors of fourteen parameters
)
FITTED_DRAWS: Final = 2000  # equally weighted ones that a mixture is fitted to


@dataclass(frozen=True)
class StudentProposal:
    """A multivariate Student distribution; mean (d,) and scale matrix (d, d)."""

    mean: FloatArray
    scale: FloatArray
    degrees_of_freedom: int = DEGREES_OF_FREEDOM

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, d)."""
        return np.asarray(self._distribution.rvs(size=count, random_state=rng))

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, d); shape (n,)."""
        return np.asarray(self._distribution.logpdf(eta))

    @property
    def _distribution(self) -> Any:  # noqa: ANN401
        return multivariate_t(self.mean, self.scale, df=self.degrees_of_freedom)


def fitted_proposal(eta: FloatArray, log_weight: FloatArray) -> StudentProposal:
    """Return a wide proposal with the mean and covariance of weighted draws (n, d).

    Where few draws carry the weight, it is flattened to a power below one until enough do.
    """
    weight = normalised(_tempering(log_weight, DRAWS_A_PARAMETER * eta.shape[1]) * log_weight)
    mean = weight @ eta
    centred = eta - mean
    covariance = centred.T @ (centred * weight[:, None])
    return StudentProposal(mean, WIDENING * covariance + RIDGE * np.eye(len(mean)))


@dataclass(frozen=True)
class StudentMixture:
    """A mixture of k Student distributions, with their shares (k,), which add up to one."""

    parts: tuple[StudentProposal, ...]
    shares: FloatArray

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (n, d), from each part as many as its share says."""
        of_part = np.bincount(resampled_rows(self.shares, count, rng), minlength=len(self.parts))
        # one draw comes back without its leading dimension
        return np.concatenate(
            [
                part.draw(many, rng).reshape(many, -1)
                for part, many in zip(self.parts, of_part, strict=True)
                if many
            ]
        )

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, d); shape (n,)."""
        of_part = np.stack([part.log_density(eta) for part in self.parts])
        return np.asarray(logsumexp(of_part, axis=0, b=self.shares[:, None]))


def fitted_mixture(eta: FloatArray, log_weight: FloatArray, seed: int) -> StudentMixture:
    """Return a mixture with the shape of weighted draws (n, d), of as many parts as these can tell apart.

    A normal mixture is fitted by expectation and maximisation, and its parts are widened. Few effective draws
    give one part, by :func:`fitted_proposal`.
    """
    weight = normalised(log_weight)
    least = DRAWS_A_PARAMETER * eta.shape[1]
    components = int(np.clip(effective_draws(weight) / (2.0 * least), 1, MOST_COMPONENTS))
    if components == 1:
        return StudentMixture((fitted_proposal(eta, log_weight),), np.ones(1))
    rows = resampled_rows(weight, FITTED_DRAWS, np.random.default_rng(seed))
    with threadpool_limits(limits=1):  # sums split over threads differ in the last bit
        fit = GaussianMixture(components, reg_covar=RIDGE, random_state=seed % 2**32).fit(eta[rows])
    parts = (
        StudentProposal(mean, WIDENING * covariance)
        for mean, covariance in zip(fit.means_, fit.covariances_, strict=True)
    )
    return StudentMixture(tuple(parts), fit.weights_ / fit.weights_.sum())


def _tempering(log_weight: FloatArray, least_effective: float) -> float:
    finite = log_weight[np.isfinite(log_weight)]
    wanted = min(least_effective, 0.5 * len(finite))
    if effective_draws(normalised(finite)) >= wanted:
        return 1.0
    return float(
        brentq(lambda power: effective_draws(normalised(power * finite)) - wanted, 0.0, 1.0, xtol=1e-6)
    )
