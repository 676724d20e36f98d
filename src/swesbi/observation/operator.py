"""The measurement operator: a simulated active cycle becomes the total curve elastography would show.

Total stiffness is E_sim = E_pass + E_act (paper, Eq. 3). It is taken at the subject's own measured
phases and interpolated from them, as the observed curve is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swesbi.observation.interpolation import sample_cycle, to_grid
from swesbi.observation.passive import PassiveBaseline
from swesbi.observation.settings import MeasurementSettings
from swesbi.observation.stiffness_map import active_stiffness_map

if TYPE_CHECKING:
    from swesbi.forward_model.beats import Beats
    from swesbi.recording.observation import Observation

FloatArray = NDArray[np.float64]
ActiveCycles: TypeAlias = "Beats | tuple[FloatArray, FloatArray]"
"""Simulated beats, or their cycle phases (M,) and active stiffness (n, M) in kPa."""


def total_cycle(active: ActiveCycles, passive: PassiveBaseline, settings: MeasurementSettings) -> FloatArray:
    """Return total stiffness E_pass + E_act over the simulated cycle, shape (n, M), in kPa.

    Raises:
        ValueError: The cycle has other phases than the passive baseline.
    """
    cycle_phase, active_stiffness_kpa = _cycles(active)
    if not np.array_equal(cycle_phase, passive.cycle_phase):
        raise ValueError(
            f"the simulated cycle has {len(cycle_phase)} points, the passive baseline "
            f"{len(passive.cycle_phase)}, or other phases; make both under the same forward-model settings"
        )
    return passive.stiffness_kpa + active_stiffness_map(settings.active_stiffness_map)(active_stiffness_kpa)


def total_at_phases(
    active: ActiveCycles, passive: PassiveBaseline, observation: Observation, settings: MeasurementSettings
) -> FloatArray:
    """Return total stiffness at every phase of the recording, measured or not, shape (n, P), in kPa."""
    cycle_phase, _ = _cycles(active)
    return sample_cycle(cycle_phase, total_cycle(active, passive, settings), observation.phase)


def total_curves(
    active: ActiveCycles, passive: PassiveBaseline, observation: Observation, settings: MeasurementSettings
) -> FloatArray:
    """Return total stiffness on the analysis grid, as the subject's measured phases show it.

    Args:
        active: Successful simulated beats, n of them.
        passive: The subject's passive baseline, on the same cycle phases.
        observation: Gives the phases and which of them were measured.
        settings: Grid size and active stiffness map.

    Returns:
        Curves E_sim in kPa; shape (n, G).

    Raises:
        ValueError: A cycle holds NaN (drop failed simulations first), or its phases do not match.
    """
    cycle_phase, _ = _cycles(active)
    total = total_cycle(active, passive, settings)
    phase = observation.measured_phase
    return to_grid(phase, sample_cycle(cycle_phase, total, phase), settings.grid_points)


def _cycles(active: ActiveCycles) -> tuple[FloatArray, FloatArray]:
    if isinstance(active, tuple):
        return active
    return active.cycle_phase, active.active_stiffness_kpa
