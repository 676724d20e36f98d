"""Shear-wave speed and apparent Young's modulus."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
PA_PER_KPA: Final = 1e3


def youngs_modulus_kpa(speed_m_s: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return the apparent Young's modulus E = 3 rho c_s^2 in kPa (paper, Sec. 2.1)."""
    return 3.0 * density_kg_m3 * speed_m_s**2 / PA_PER_KPA


def shear_wave_speed_m_s(modulus_kpa: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return the speed c_s = sqrt(E / (3 rho)) in m/s behind an apparent Young's modulus."""
    return np.sqrt(squared_speed_m2_s2(modulus_kpa, density_kg_m3))


def squared_speed_m2_s2(modulus_kpa: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return c_s^2 = E / (3 rho) behind an apparent Young's modulus."""
    return modulus_kpa * PA_PER_KPA / (3.0 * density_kg_m3)
