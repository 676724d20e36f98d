"""The quantities whose identifiability is studied, and what the draws of a posterior tell of them.

They are what is reported of phi, and the isometric stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import ISOMETRIC, K_0, K_ATP, OF_INTEREST, PHI_NAMES
from swesbi.prior import spread_points

QUANTITY_NAMES: Final = (*PHI_NAMES, ISOMETRIC)


def quantities(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return the reported part of phi (n, d) and k_0 (1 - exp(-k_ATP D_T)); shape (n, 5)."""
    return np.column_stack(
        [phi[:, OF_INTEREST], isometric_stiffness_kpa(phi, model.activation_duration_s(phi))]
    )


def prior_quantities(model: SpeedModel) -> FloatArray:
    """Return the quantities of 2^16 points spread over the prior by a Sobol sequence, (65536, 5)."""
    return quantities(model, spread_points(model.settings.prior))


def log_gradient(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return d log quantity / d log phi of phi (n, d), shape (n, 5, d).

    With u = k_ATP D_T, log(1 - exp(-u)) changes by u / (exp(u) - 1) for each unit of log k_ATP, and of log D.
    """
    names = model.settings.prior.names
    gradient = np.zeros((len(phi), len(QUANTITY_NAMES), len(names)))
    gradient[:, : len(PHI_NAMES), : len(PHI_NAMES)] = np.eye(len(PHI_NAMES))
    exponent = phi[:, K_ATP] * model.activation_duration_s(phi)
    gradient[:, -1, K_0] = 1.0
    gradient[:, -1, K_ATP] = exponent / np.expm1(exponent)
    if "activation_duration_s" in names:
        gradient[:, -1, names.index("activation_duration_s")] = gradient[:, -1, K_ATP]
    return gradient


@dataclass(frozen=True)
class Contraction:
    """1 - posterior variance / prior variance of q quantities, themselves and their logarithms; (q,) each.

    One: the recording tells the quantity exactly. Zero: it tells nothing. Negative: the posterior is wider
    than the prior, which happens for a value far out in a skewed prior.
    """

    linear: FloatArray
    logarithm: FloatArray


def contraction(draws: FloatArray, prior_draws: FloatArray) -> Contraction:
    """Compare posterior draws (n, q) of positive quantities with prior draws (m, q)."""
    return Contraction(
        1.0 - draws.var(axis=0) / prior_draws.var(axis=0),
        1.0 - np.log(draws).var(axis=0) / np.log(prior_draws).var(axis=0),
    )


def log_correlations(draws: FloatArray, parameters: FloatArray) -> FloatArray:
    """Return correlations (q, d) of the logarithms of quantities (n, q) and parameters (n, d)."""
    quantities = draws.shape[1]
    together = np.corrcoef(np.log(draws), np.log(parameters), rowvar=False)
    return np.asarray(together[:quantities, quantities:])
