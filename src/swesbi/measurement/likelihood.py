"""The likelihood of the measured speeds, and the model of one recording: phi in, log posterior out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from swesbi.arrays import FloatArray
from swesbi.base import Settings
from swesbi.heart.model import activation_duration_s
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import ActiveBeats, Beats, simulate, simulate_active
from swesbi.measurement.settings import DiscrepancySettings, MeasurementSettings, PassiveSettings
from swesbi.measurement.speeds import (
    PassiveShape,
    PredictedSpeeds,
    SpeedRecording,
    active_at_phases,
    predict_speeds,
    reference_shape,
)
from swesbi.parameters import OF_THETA, SCALE
from swesbi.prior import JointPriorSettings, PriorSettings, log_centre, log_density


def log_speed_sd(
    predicted: PredictedSpeeds, relative_se: FloatArray, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return the standard deviation of the measured log speeds about the predicted ones; shape (n, p).

    sd^2 = se^2 + delta^2 + (tau d log c / ds)^2: the relative standard error of the mean speed, the
    model's relative error, and its error in phase carried over by the slope (first order in each).

    Args:
        predicted: Log speeds and slopes of n simulations.
        relative_se: Standard error over mean, at the p phases; shape (p,) or (n, p).
        discrepancy: delta and tau.
    """
    timing = discrepancy.timing_cycle * predicted.slope
    return np.asarray(np.sqrt(relative_se**2 + discrepancy.speed_fraction**2 + timing**2))


def residuals(
    predicted: PredictedSpeeds, recording: SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return the standardised residuals (log c_obs - log c) / sd at the measured phases; shape (n, p)."""
    sd = log_speed_sd(predicted, recording.relative_se, discrepancy)
    return np.asarray((np.log(recording.speed_m_s) - predicted.log_speed) / sd)


def log_likelihood(
    predicted: PredictedSpeeds, recording: SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return log p(log c_obs | phi) of n simulations at the measured phases; shape (n,).

    Simulations that failed (NaN) have likelihood zero.
    """
    sd = log_speed_sd(predicted, recording.relative_se, discrepancy)
    z = (np.log(recording.speed_m_s) - predicted.log_speed) / sd
    total = normal_log_density(z, np.log(sd)).sum(axis=1)
    return np.where(np.isnan(total), -np.inf, total)


def normal_log_density(z: FloatArray, log_sd: FloatArray) -> FloatArray:
    """Return the normal log density of data whose standardised residuals are z; of the data's shape."""
    return np.asarray(-0.5 * z**2 - log_sd - 0.5 * np.log(2.0 * np.pi))


def draw_speeds(
    predicted: PredictedSpeeds,
    relative_se: FloatArray,
    discrepancy: DiscrepancySettings,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw one recording's speeds (n, p), in m/s, for each of n simulations."""
    sd = log_speed_sd(predicted, relative_se, discrepancy)
    return np.asarray(np.exp(predicted.log_speed + sd * rng.standard_normal(sd.shape)))


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


@dataclass
class CachedModel:
    """The model of a recording, which keeps the prediction for the array of draws that it saw last."""

    model: SpeedModel
    _last: tuple[FloatArray, PredictedSpeeds] | None = field(default=None, init=False)

    @property
    def settings(self) -> SpeedModelSettings:
        """The settings of the model, its prior among them."""
        return self.model.settings

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of shape (n,); -inf where the simulation failed."""
        predicted = self.model.predict(phi)
        self._last = (phi, predicted)
        return log_likelihood(predicted, self.model.recording, self.model.settings.discrepancy)

    def predict(self, phi: FloatArray) -> PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, 4), cached if it is the very array seen last."""
        if self._last is not None and self._last[0] is phi:
            return self._last[1]
        return self.model.predict(phi)
