"""From the simulated active stiffness to the active part of what elastography measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
StiffnessMap = Callable[[FloatArray], FloatArray]
SERIES_MODULUS_KPA: Final = (
    300.0  # chosen: several times the peaks of the study, so that the map bends them only
)


def identity(active_stiffness_kpa: FloatArray) -> FloatArray:
    """Return E_act = k_c: the stiffness d tau_c / d e_c of the attached bonds, frozen for the wave's time.

    A shear wave passes in a millisecond, in which bonds neither form nor break (active law of Chapelle
    et al. 2012).

    Args:
        active_stiffness_kpa: k_c; any shape.
    """
    return active_stiffness_kpa


def series_spring(active_stiffness_kpa: FloatArray) -> FloatArray:
    """Return E_act = k_c E_s / (k_c + E_s): the bonds with an elastic element in series.

    Sarcomere models have such an element (Caruel et al. 2014, where its strain is part of the fibre's);
    here it is rigid in the mechanics and enters the measured stiffness alone, to see what it would change.

    Args:
        active_stiffness_kpa: k_c; any shape.
    """
    return active_stiffness_kpa * SERIES_MODULUS_KPA / (active_stiffness_kpa + SERIES_MODULUS_KPA)


ACTIVE_STIFFNESS_MAPS: Final[Mapping[str, StiffnessMap]] = {
    "identity": identity,
    "series_spring": series_spring,
}


def active_stiffness_map(name: str) -> StiffnessMap:
    """Return the map of this name; a further one is added to ``ACTIVE_STIFFNESS_MAPS`` and the settings.

    Raises:
        ValueError: No map has this name.
    """
    if name not in ACTIVE_STIFFNESS_MAPS:
        raise ValueError(f"no active stiffness map {name!r}; known: {', '.join(ACTIVE_STIFFNESS_MAPS)}")
    return ACTIVE_STIFFNESS_MAPS[name]
