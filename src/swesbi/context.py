"""The subject-specific context c_d: anatomy, physiology and demography of one subject."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

CONTEXT_NAMES: Final = (
    "sex_male",
    "age_years",
    "bsa_m2",
    "hr_bpm",
    "lvedv_ml",
    "lvesv_ml",
    "ivsd_cm",
)
CONTEXT_UNITS: Final = ("1", "year", "m2", "1/min", "mL", "mL", "cm")


@dataclass(frozen=True)
class Context:
    """One subject's context.

    HR, IVSd and LVEDV set the simulator (paper, Eq. 2); the others condition the posterior only.
    """

    subject: str
    sex: Literal["F", "M"]
    age_years: float
    bsa_m2: float
    hr_bpm: float
    lvedv_ml: float
    lvesv_ml: float
    ivsd_cm: float

    @property
    def period_s(self) -> float:
        """Cardiac period T_d = 60 / HR (paper, Eq. 2)."""
        return 60.0 / self.hr_bpm

    @property
    def thickness_m(self) -> float:
        """Reference wall thickness d_0 = 1e-2 IVSd (paper, Eq. 2)."""
        return 1e-2 * self.ivsd_cm

    @property
    def radius_m(self) -> float:
        """Reference radius R_0 of a sphere of volume LVEDV (paper, Eq. 2)."""
        return float(np.cbrt(3e-6 * self.lvedv_ml / (4.0 * np.pi)))

    def as_array(self) -> NDArray[np.float64]:
        """Return the seven context values in the order of ``CONTEXT_NAMES``; sex is 1 for male."""
        values = [self.age_years, self.bsa_m2, self.hr_bpm, self.lvedv_ml, self.lvesv_ml]
        return np.array([float(self.sex == "M"), *values, self.ivsd_cm])
