"""Densities of a parameter on a logarithmic axis: of draws, and of the prior."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gaussian_kde, norm

from swesbi.prior import ParameterPrior

FloatArray = NDArray[np.float64]
POINTS = 256


def log_density_of_draws(draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return theta and the density per unit of log theta, from draws (n,) by a Gaussian kernel.

    The support ends at the extreme draws. Draws that are all equal give one point of density 1.
    """
    if np.ptp(draws) == 0.0:
        return draws[:1], np.ones(1)
    log_theta = np.log(draws)
    at = np.linspace(log_theta.min(), log_theta.max(), POINTS)
    return np.exp(at), gaussian_kde(log_theta)(at)


def log_density_of_prior(prior: ParameterPrior) -> tuple[FloatArray, FloatArray]:
    """Return theta from bound to bound and the prior's density per unit of log theta."""
    at = np.linspace(np.log(prior.low), np.log(prior.high), POINTS)
    standard = norm(np.log(prior.centre), prior.log_sd)
    mass = standard.cdf(np.log(prior.high)) - standard.cdf(np.log(prior.low))
    return np.exp(at), standard.pdf(at) / mass
