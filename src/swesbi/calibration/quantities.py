"""What is ranked: the four parameters, and test quantities that depend on several of them or on the data."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation import subject_model
from swesbi.evaluation.draws import attained_stiffness_kpa
from swesbi.parameters import PHI_NAMES
from swesbi.prior import JointPriorSettings, quantile
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]
ATTAINED: Final = "attained_stiffness_kpa"
LOG_LIKELIHOOD: Final = "log_likelihood"
QUANTITY_NAMES: Final = (*PHI_NAMES, ATTAINED, LOG_LIKELIHOOD)
VARIANCE_POINTS: Final = 100_000


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
    return np.column_stack([phi, attained_stiffness_kpa(phi[:, :3], duration_s), log_likelihood])


def activation_duration_s(model: SpeedModel) -> float:
    """Return the duration D_T of the activation at the heart rate of the model's recording."""
    return subject_model.activation_duration_s(model.recording.context, model.settings.forward_model)


def prior_variance(model: SpeedModel) -> FloatArray:
    """Return the variance of each quantity under the prior; shape (6,).

    From the prior's quantile functions; k_0 and k_ATP are independent. The log-likelihood has none (NaN).
    """
    phi = _quantiles(model.settings.prior)
    share = -np.expm1(-phi[:, 1] * activation_duration_s(model))
    second, first = (np.mean(phi[:, 0] ** p) * np.mean(share**p) for p in (2, 1))
    return np.array([*phi.var(axis=0), second - first**2, np.nan])


@lru_cache(maxsize=4)
def _quantiles(prior: JointPriorSettings) -> FloatArray:
    """Return the quantiles of the prior at even levels; the same for every subject."""
    u = (np.arange(VARIANCE_POINTS) + 0.5) / VARIANCE_POINTS
    return quantile(np.repeat(u[:, None], len(PHI_NAMES), axis=1), prior)
