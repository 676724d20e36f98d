"""A Student distribution fitted to weighted draws: a proposal with tails for its weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import normalised

DEGREES_OF_FREEDOM: Final = 8  # heavier tails than a posterior's, so that weights stay bounded
WIDENING: Final = 1.2  # of the covariance
RIDGE: Final = 1e-4  # least variance of a proposal, in eta
DRAWS_A_PARAMETER: Final = 2.5  # effective ones behind a proposal; a posterior with fewer is flattened


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
        from scipy.stats import multivariate_t

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


def _tempering(log_weight: FloatArray, least_effective: float) -> float:
    """Return the power of weights (n,), at most one, at which so many draws are effective."""
    from scipy.optimize import brentq

    known = log_weight[np.isfinite(log_weight)]
    relative = known - known.max()
    wanted = min(least_effective, 0.5 * len(known))

    def lacking(power: float) -> float:
        weight = np.exp(power * relative)
        return wanted - float(weight.sum() ** 2 / (weight**2).sum())

    return 1.0 if lacking(1.0) <= 0.0 else float(brentq(lacking, 0.0, 1.0, xtol=1e-6))
