"""The joint prior of phi = (theta, a), and the map of its box onto the whole space by the logit."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import expit, log_expit

from swesbi.settings import Settings
from swesbi.simulations.prior import ParameterPrior, PriorSettings, bounds
from swesbi.theta import THETA_COLUMNS, THETA_NAMES

FloatArray = NDArray[np.float64]
PHI_NAMES: Final = (*THETA_NAMES, "passive_scale_kpa")
PHI_COLUMNS: Final = f"{THETA_COLUMNS}, kPa"
"""Units of the columns of phi, as artefacts say them."""


class JointPriorSettings(Settings):
    """Bounded log-Gaussian priors of theta and of the passive scale a, independent.

    The functions of :mod:`swesbi.simulations.prior` take it as they take a prior of theta.
    """

    theta: PriorSettings
    passive_scale_kpa: ParameterPrior = Field(description="prior of the passive scale a, in kPa")

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The four priors in the order of ``PHI_NAMES``."""
        return (*self.theta.parameters, self.passive_scale_kpa)


def to_logit(phi: FloatArray, prior: JointPriorSettings) -> FloatArray:
    """Map phi (..., 4) inside the prior's box to log((phi - low) / (high - phi)), unbounded."""
    low, high = bounds(prior)
    return np.asarray(np.log(phi - low) - np.log(high - phi))


def from_logit(eta: FloatArray, prior: JointPriorSettings) -> FloatArray:
    """Map any eta (..., 4) into the prior's box, the inverse of :func:`to_logit`; never onto its faces."""
    low, high = bounds(prior)
    phi = low + (high - low) * expit(eta)
    return np.asarray(np.clip(phi, np.nextafter(low, high), np.nextafter(high, low)))


def log_jacobian(eta: FloatArray, prior: JointPriorSettings) -> FloatArray:
    """Return log |d phi / d eta| of shape (...) for eta (..., 4); p(eta) = p(phi) times it."""
    low, high = bounds(prior)
    terms = log_expit(eta) + log_expit(-eta) + np.log(high - low)
    return np.asarray(terms.sum(axis=-1))
