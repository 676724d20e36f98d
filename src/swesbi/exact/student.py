"""Proposals fitted to weighted draws: Student distributions of eta, the logit of phi in its box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import multivariate_t

from swesbi.exact.weights import effective_draws, normalised

FloatArray = NDArray[np.float64]
DEGREES_OF_FREEDOM: Final = 4  # heavy tails, so that weights stay bounded
WIDENING: Final = 1.5  # of the covariance
RIDGE: Final = 1e-4  # least variance of a proposal, in eta
TEMPERED_DRAWS: Final = 40.0  # effective draws behind a proposal, of a flattened posterior where it has fewer


@dataclass(frozen=True)
class StudentProposal:
    """A multivariate Student distribution; mean (4,) and scale matrix (4, 4)."""

    mean: FloatArray
    scale: FloatArray

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, 4)."""
        return np.asarray(self._distribution.rvs(size=count, random_state=rng))

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, 4); shape (n,)."""
        return np.asarray(self._distribution.logpdf(eta))

    @property
    def _distribution(self) -> Any:  # noqa: ANN401
        return multivariate_t(self.mean, self.scale, df=DEGREES_OF_FREEDOM)


def fitted_proposal(eta: FloatArray, log_weight: FloatArray) -> StudentProposal:
    """Return a wide proposal with the mean and covariance of weighted draws (n, 4).

    Where few draws carry the weight, it is flattened to a power below one until enough do.
    """
    weight = normalised(_tempering(log_weight) * log_weight)
    mean = weight @ eta
    centred = eta - mean
    covariance = centred.T @ (centred * weight[:, None])
    return StudentProposal(mean, WIDENING * covariance + RIDGE * np.eye(len(mean)))


def _tempering(log_weight: FloatArray) -> float:
    finite = log_weight[np.isfinite(log_weight)]
    wanted = min(TEMPERED_DRAWS, 0.5 * len(finite))
    if effective_draws(normalised(finite)) >= wanted:
        return 1.0
    return float(
        brentq(lambda power: effective_draws(normalised(power * finite)) - wanted, 0.0, 1.0, xtol=1e-6)
    )
