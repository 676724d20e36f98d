"""What is ranked: the four parameters, and test quantities that depend on several of them or on the data."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.activation import attained_share, attained_stiffness_kpa
from swesbi.parameters import ATTAINED, K_0, K_ATP, PHI_NAMES
from swesbi.prior import even_quantiles
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]
LOG_LIKELIHOOD: Final = "log_likelihood"
QUANTITY_NAMES: Final = (*PHI_NAMES, ATTAINED, LOG_LIKELIHOOD)


def quantities(phi: FloatArray, log_likelihood: FloatArray, duration_s: float) -> FloatArray:
    """Return the six quantities of ``QUANTITY_NAMES`` for n draws; shape (n, 6).

    k_0 (1 - exp(-k_ATP D_T)) is what the data know best of k_0 and k_ATP. The log-likelihood depends on the
    data, and so finds posteriors that are calibrated in every parameter without having seen them (Modrak
    et al. 2023, Simulation-based calibration checking for Bayesian computation: the choice of test quantities
    shapes sensitivity).

    Args:
        phi: Draws; shape (n, 4).
        log_likelihood: Their log-likelihood; shape (n,).
        duration_s: Duration D_T of the activation.
    """
    return np.column_stack([phi, attained_stiffness_kpa(phi, duration_s), log_likelihood])


def prior_variance(model: SpeedModel) -> FloatArray:
    """Return the variance of each quantity under the prior; shape (6,).

    From the prior's quantile functions; k_0 and k_ATP are independent. The log-likelihood has none (NaN).
    """
    phi = even_quantiles(model.settings.prior)
    share = attained_share(phi[:, K_ATP], model.activation_duration_s)
    second, first = (np.mean(phi[:, K_0] ** p) * np.mean(share**p) for p in (2, 1))
    return np.array([*phi.var(axis=0), second - first**2, np.nan])
