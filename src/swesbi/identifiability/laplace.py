"""Expected posterior spread: prior precision plus expected information, in log phi.

In log phi the prior is normal within its bounds, with precision 1 / log_sd^2. About phi the posterior of
a recording with information I(phi) is then near normal with covariance (Lambda + I(phi))^-1 (Laplace's
approximation with the expected for the observed information; Chaloner and Verdinelli, Stat Sci 10:273,
1995, Sec. 2). The bounds and the curvature beyond second order are left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from swesbi.prior import BoxPrior

FloatArray = NDArray[np.float64]


def prior_precision(prior: BoxPrior) -> FloatArray:
    """Return Lambda, (d, d)."""
    return np.diag(np.array([parameter.log_sd for parameter in prior.parameters]) ** -2.0)


def expected_variance(precision: FloatArray, information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Return the variances of log quantities, (..., n, q), from I (..., n, d, d) and d log q (n, q, d)."""
    covariance = np.linalg.inv(precision + information)
    return np.asarray(np.einsum("nqj,...njk,nqk->...nq", gradient, covariance, gradient))


def expected_sd(precision: FloatArray, information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Return the root of the variance averaged over the n draws, (..., q).

    The mean over draws from the posterior is what this subject's next recording is expected to leave.
    """
    return np.asarray(np.sqrt(expected_variance(precision, information, gradient).mean(axis=-2)))


def interval_fold(sd_log: FloatArray, mass: float) -> FloatArray:
    """Return upper over lower end of the credible interval of a log-normal quantity."""
    return np.asarray(np.exp(2.0 * norm.ppf(0.5 + 0.5 * mass) * sd_log))
