"""A periodic beat of a heart that another program or another law made, and whether it is one of a person."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray

PHASES: Final = 200
"""Points of a stored beat, as many as the model's own has; uniform from the R peak."""


@dataclass(frozen=True)
class Beat:
    """A beat at uniform phases from the R peak, of shape (M,) each."""

    active_kpa: Annotated[FloatArray, Variable("cycle", "kPa", "active stiffness that a shear wave meets")]
    stretch: Annotated[FloatArray, Variable("cycle", "1", "stretch of the wall")]
    volume_ml: Annotated[FloatArray, Variable("cycle", "mL", "cavity volume")]
    ventricular_mmhg: Annotated[FloatArray, Variable("cycle", "mmHg", "pressure in the cavity")]
    arterial_mmhg: Annotated[FloatArray, Variable("cycle", "mmHg", "pressure in the aorta")]

    def __post_init__(self) -> None:
        """Refuse a beat that is no numbers; a RuntimeError names the curve."""
        for name, curve in vars(self).items():
            if not np.isfinite(curve).all():
                raise RuntimeError(f"the beat's {name} is not finite throughout the cycle")

    @property
    def phase(self) -> FloatArray:
        """Fractions of the cycle; shape (M,)."""
        return np.asarray(np.arange(self.stretch.size) / self.stretch.size)

    @property
    def ejection_fraction(self) -> float:
        """(EDV - ESV) / EDV."""
        return 1.0 - self.volume_ratio

    @property
    def volume_ratio(self) -> float:
        """ESV / EDV, smallest over largest volume."""
        return float(self.volume_ml.min() / self.volume_ml.max())
