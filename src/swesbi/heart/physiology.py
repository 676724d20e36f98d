"""Physiology by simulation: what a simulation may have of its own beside theta, in SI units.

The settings of the forward model give these numbers once for all simulations. Where they are not known of a
heart, every simulation takes values of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray
from swesbi.heart.settings import ForwardModelSettings
from swesbi.parameters import PHYSIOLOGY

TIME_CONSTANT: Final = "arterial_time_constant_s"
CAPACITANCE: Final = "systemic_capacitance_m3_pa"
VOLUME_FACTOR: Final = "stressed_volume_factor"
RANGES: Final = {
    CAPACITANCE if parameter.name == TIME_CONSTANT else parameter.name: (
        (1e-9, 1e-7) if parameter.name == TIME_CONSTANT else parameter.declared
    )
    for parameter in PHYSIOLOGY
}
"""Declared range of each quantity, by the name of its field of :class:`Physiology`."""


@dataclass(frozen=True)
class Physiology:
    """Physiology of n simulations, every array of shape (n,); names and meanings are those of the settings.

    Times count from the R peak; the duration is that at the settings' reference period. The wall's factor
    multiplies both moduli of the passive wall. The factor of the stressed volume multiplies what the closed
    loop starts with, whatever its C_s (``heart.model.starts``).
    """

    activation_onset_s: FloatArray
    activation_duration_s: FloatArray
    activation_ramp_s: FloatArray
    destruction_alpha: FloatArray
    sigma_0_pa: FloatArray
    passive_wall_factor: FloatArray
    distal_resistance_pa_s_m3: FloatArray
    systemic_capacitance_m3_pa: FloatArray
    stressed_volume_factor: FloatArray
    length_dependence: FloatArray
    atrial_kick_pa: FloatArray
    atrial_delay_s: FloatArray

    @classmethod
    def of_settings(cls, settings: ForwardModelSettings, n: int) -> Self:
        """Return the settings' own values for ``n`` simulations; replace what is to differ between them."""
        own = dict.fromkeys(FACTORS, 1.0) | {
            name: getattr(settings, name) for name in NAMES if name not in FACTORS
        }
        return cls(**{name: np.full(n, own[name]) for name in NAMES})

    @classmethod
    def of_nuisances(
        cls, values: FloatArray, names: Sequence[str], settings: ForwardModelSettings
    ) -> Self | None:
        """Return the physiology that free nuisance parameters (n, k) say; the settings' own for the others.

        The capacitance follows from the time constant of the arteries, C_s = (R_d C_s) / R_d.
        None where no parameter is free.
        """
        if not names:
            return None
        free = dict(zip(names, values.T, strict=True))
        time_constant_s = free.pop(TIME_CONSTANT, None)
        physiology = replace(cls.of_settings(settings, len(values)), **free)
        if time_constant_s is None:
            return physiology
        return replace(physiology, **{CAPACITANCE: time_constant_s / physiology.distal_resistance_pa_s_m3})

    def rows(self, rows: NDArray[np.intp] | slice) -> Self:
        """Return the physiology of these simulations."""
        return type(self)(**{name: getattr(self, name)[rows] for name in NAMES})

    def checked(self, n: int) -> Self:
        """Return it as floats of shape (n,); ValueError where one is not finite or outside its range."""
        return type(self)(**{name: _checked(name, getattr(self, name), n) for name in NAMES})


NAMES: Final = tuple(field.name for field in fields(Physiology))
"""The quantities in the order of their fields."""
FACTORS: Final = ("passive_wall_factor", VOLUME_FACTOR)
"""Those of them that multiply what the settings have, instead of taking its place."""


def _checked(name: str, values: FloatArray, n: int) -> FloatArray:
    values = np.asarray(values, dtype=np.float64)
    if values.shape != (n,):
        raise ValueError(
            f"physiology: {name} has shape {values.shape}; expected ({n},), a value for each row of theta"
        )
    low, high = RANGES[name]
    wrong = np.flatnonzero(~((values >= low) & (values <= high)))
    if wrong.size:
        raise ValueError(
            f"physiology row {wrong[0]}: {name} = {values[wrong[0]]:g} is outside [{low:g}, {high:g}]; "
            "check its unit"
        )
    return values
