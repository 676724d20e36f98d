"""The quantities whose identifiability is studied: phi, and the stiffness that contraction attains."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.activation import attained_stiffness_kpa
from swesbi.parameters import ATTAINED, K_0, K_ATP, PHI_NAMES

FloatArray = NDArray[np.float64]
QUANTITY_NAMES: Final = (*PHI_NAMES, ATTAINED)
QUANTITY_UNITS: Final = "kPa, s-1, s-1, kPa, kPa"


def quantities(phi: FloatArray, duration_s: float) -> FloatArray:
    """Append k_0 (1 - exp(-k_ATP D_T)) to phi (n, 4), giving (n, 5) in the order of ``QUANTITY_NAMES``."""
    return np.column_stack([phi, attained_stiffness_kpa(phi, duration_s)])


def log_gradient(phi: FloatArray, duration_s: float) -> FloatArray:
    """Return d log quantity / d log phi, shape (n, 5, 4).

    With u = k_ATP D_T, log(1 - exp(-u)) changes by u / (exp(u) - 1) for each unit of log k_ATP.
    """
    gradient = np.zeros((len(phi), len(QUANTITY_NAMES), len(PHI_NAMES)))
    gradient[:, : len(PHI_NAMES)] = np.eye(len(PHI_NAMES))
    exponent = phi[:, K_ATP] * duration_s
    gradient[:, -1, K_0] = 1.0
    gradient[:, -1, K_ATP] = exponent / np.expm1(exponent)
    return gradient
