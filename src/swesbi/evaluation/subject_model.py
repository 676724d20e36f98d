"""The forward model of one subject as it was measured: theta -> total stiffness curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.activation import activation_duration_s
from swesbi.forward_model.beats import Beats
from swesbi.forward_model.periodic import Status
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import simulate
from swesbi.observation.operator import total_at_phases, total_curves
from swesbi.observation.passive import PassiveBaseline
from swesbi.observation.settings import MeasurementSettings
from swesbi.recording.observation import Observation

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SubjectModel:
    """One subject's simulator, passive baseline and measurement operator."""

    observation: Observation
    passive: PassiveBaseline
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings

    @property
    def activation_duration_s(self) -> float:
        """Duration D_T of activation at the subject's heart rate."""
        return activation_duration_s(self.observation.context.period_s, self.forward_model)

    def simulate(self, theta: FloatArray) -> Beats:
        """Simulate theta of shape (n, 3) in the subject's context; failed rows hold NaN."""
        return simulate(theta, self.observation.context, self.forward_model)

    def on_grid(self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray) -> FloatArray:
        """Return total curves (n, grid) in kPa, measured at the subject's measured phases."""
        active = (cycle_phase, active_stiffness_kpa)
        return total_curves(active, self.passive, self.observation, self.measurement)

    def at_phases(self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray) -> FloatArray:
        """Return total stiffness (n, phases) in kPa at every phase of the recording."""
        active = (cycle_phase, active_stiffness_kpa)
        return total_at_phases(active, self.passive, self.observation, self.measurement)

    def curves(self, theta: FloatArray) -> FloatArray:
        """Return the curves (n, grid) of theta (n, 3) in kPa; NaN where the simulation failed."""
        beats = self.simulate(theta)
        good = beats.status == Status.PERIODIC
        curves = np.full((len(theta), self.measurement.grid_points), np.nan)
        if good.any():
            curves[good] = self.on_grid(beats.cycle_phase, beats.active_stiffness_kpa[good])
        return curves
