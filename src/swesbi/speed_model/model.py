"""The model of one recording: phi in, predicted speeds and log posterior out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.activation import activation_duration_s
from swesbi.forward_model.beats import ActiveBeats, Beats
from swesbi.forward_model.periodic import Status
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import simulate, simulate_active
from swesbi.observation.settings import MeasurementSettings, PassiveSettings
from swesbi.parameters import OF_THETA, SCALE
from swesbi.prior import JointPriorSettings, PriorSettings, log_centre, log_density
from swesbi.settings import Settings
from swesbi.speed_model.likelihood import log_likelihood
from swesbi.speed_model.prediction import (
    PassiveShape,
    PredictedSpeeds,
    active_at_phases,
    predict_speeds,
    reference_shape,
)
from swesbi.speed_model.recording import SpeedRecording
from swesbi.speed_model.settings import DiscrepancySettings

FloatArray = NDArray[np.float64]


class SpeedModelSettings(Settings):
    """Everything that the model of a recording depends on; the stages of an experiment on speeds share it."""

    prior: JointPriorSettings
    discrepancy: DiscrepancySettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    passive: PassiveSettings
    passive_reference_prior: PriorSettings
    density_kg_m3: float


@dataclass(frozen=True)
class SpeedModel:
    """One recording with its passive shape under the settings of an experiment."""

    recording: SpeedRecording
    shape: PassiveShape
    settings: SpeedModelSettings

    @property
    def activation_duration_s(self) -> float:
        """Duration D_T of activation at the subject's heart rate."""
        return activation_duration_s(self.recording.context.period_s, self.settings.forward_model)

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi of shape (n, 4) in the subject's context; failed rows hold NaN."""
        return simulate(phi[:, OF_THETA], self.recording.context, self.settings.forward_model)

    def predict(self, phi: FloatArray) -> PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, 4) at the measured phases; NaN where it failed."""
        settings = self.settings.forward_model
        return self.predict_from(
            phi[:, SCALE], simulate_active(phi[:, OF_THETA], self.recording.context, settings)
        )

    def predict_from(self, scale_kpa: FloatArray, beats: Beats | ActiveBeats) -> PredictedSpeeds:
        """Return the noiseless log speeds of simulated beats with passive scales (n,)."""
        stiffness = np.where((beats.status == Status.PERIODIC)[:, None], beats.active_stiffness_kpa, np.nan)
        phase = self.recording.phase
        active = active_at_phases(
            beats.cycle_phase, stiffness, phase, self.settings.measurement.active_stiffness_map
        )
        return predict_speeds(scale_kpa, active, self.shape, phase, self.settings.density_kg_m3)

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of shape (n,); -inf where the simulation failed."""
        return log_likelihood(self.predict(phi), self.recording, self.settings.discrepancy)

    def log_posterior(self, phi: FloatArray) -> FloatArray:
        """Return log p(phi) + log p(speeds | phi), not normalised, (n,); -inf outside the prior's box."""
        log_prior = log_density(phi, self.settings.prior)
        inside = np.isfinite(log_prior)
        if inside.any():
            log_prior[inside] += self.log_likelihood(phi[inside])
        return log_prior


def speed_model(recording: SpeedRecording, settings: SpeedModelSettings) -> SpeedModel:
    """Build the model of a recording; the reference beat runs at the reference prior's log-centre.

    Raises:
        ValueError: The reference beat does not become periodic.
    """
    centre = log_centre(settings.passive_reference_prior)
    shape = reference_shape(recording.context, centre, settings.forward_model, settings.passive.exponent_b)
    return SpeedModel(recording, shape, settings)
