"""The passive law that was shipped before: one exponent, and a factor of its own in compression.

E_pass = a exp(b (lambda^2 - 1)), where the wall is compressed with another slope of its logarithm. What a
wall did in compression depended on what it does in stretch, and answers to hearts of other walls were wrong
unnoticed. Development and tests put it back, to show what it costs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.simulate import ActiveBeats, Beats, simulate, simulate_active
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, log_likelihood
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording
from swesbi.parameters import OF_THETA, STRETCHED
from swesbi.prior import ParameterPrior
from swesbi.recording.phases import sample_cycle
from swesbi.recording.speed import squared_speed_m2_s2

COMPRESSED: Final = 0.85**2 - 1.0
"""Strain lambda^2 - 1 at which the factor in compression holds."""
OWN: Final = (
    ParameterPrior(centre=3.0, log_sd=0.3, low=0.904, high=9.96),
    ParameterPrior(centre=1.0, log_sd=1.5, low=0.05, high=20.0),
)
"""Priors of b and of the factor, behind all other parameters."""
SCALE: Final = ParameterPrior(centre=2.2, log_sd=0.4, low=0.5, high=8.0)
REPLACED: Final = ("length_dependence", "passive_ratio", "passive_middle_factor")
"""Nuisance parameters of the shipped model that it did not have."""


@dataclass(frozen=True)
class FormerPrior:
    """The prior of phi = (theta, a, other nuisances, b, factor)."""

    parameters: tuple[ParameterPrior, ...]


@dataclass(frozen=True)
class FormerSettings:
    """Settings of the former model.

    Attributes:
        others: The shipped model's, less ``REPLACED``.
    """

    others: SpeedModelSettings

    @property
    def discrepancy(self) -> DiscrepancySettings:
        """What the model may miss of a speed."""
        return self.others.discrepancy

    @property
    def prior(self) -> FormerPrior:
        """The prior of phi (d,)."""
        parameters = list(self.others.prior.parameters)
        parameters[STRETCHED] = SCALE
        return FormerPrior((*parameters, *OWN))


@dataclass(frozen=True)
class FormerLaw:
    """The model of a recording under the former law; as ``SpeedModel`` has it."""

    recording: SpeedRecording
    settings: FormerSettings

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi (n, d) in the subject's context."""
        others = self.settings.others
        return simulate(
            phi[:, OF_THETA], self.recording.context, others.forward_model, others.physiology(phi)
        )

    def parts(self, phi: FloatArray, cycles: Beats | ActiveBeats) -> tuple[FloatArray, FloatArray]:
        """Return passive and active stiffness in kPa of simulations of phi (n, d); (n, M) each."""
        strain, (exponent, factor) = cycles.stretch**2 - 1.0, phi[:, -len(OWN) :].T[..., None]
        slope = exponent * strain + np.log(factor) * np.minimum(strain, 0.0) / COMPRESSED
        return phi[:, STRETCHED, None] * np.exp(slope), cycles.active_stiffness_kpa

    def predict(self, phi: FloatArray) -> PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, d); without slopes, which no error needs."""
        others = self.settings.others
        assert others.discrepancy.timing_cycle == 0.0, "the slopes would be needed"
        physiology = others.physiology(phi)
        cycles = simulate_active(phi[:, OF_THETA], self.recording.context, others.forward_model, physiology)
        total = sample_cycle(cycles.cycle_phase, np.add(*self.parts(phi, cycles)), self.recording.phase)
        log_speed = 0.5 * np.log(squared_speed_m2_s2(np.maximum(total, 1e-3), others.density_kg_m3))
        log_speed = log_speed + np.log(self.speed_scale(phi))[:, None]
        return PredictedSpeeds(log_speed, np.zeros_like(log_speed))

    def activation_duration_s(self, phi: FloatArray) -> FloatArray:
        """Return the duration D_T of activation at the subject's heart rate, of phi (n, d); shape (n,)."""
        return SpeedModel(self.recording, self.settings.others).activation_duration_s(phi)

    def speed_scale(self, phi: FloatArray) -> FloatArray:
        """Return the scale of the speeds of phi (n, d); shape (n,)."""
        return np.broadcast_to(self.settings.others.measured_by(phi).speed_scale, len(phi))

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of shape (n,); -inf where the simulation failed."""
        return log_likelihood(self.predict(phi), self.recording, self.settings.discrepancy)


def former_law(recording: SpeedRecording, shipped: SpeedModelSettings) -> FormerLaw:
    """Return the model of a recording under the former law, all else as shipped."""
    return FormerLaw(recording, FormerSettings(changed(shipped, dict.fromkeys(REPLACED))))


def changed(model: SpeedModelSettings, priors: Mapping[str, ParameterPrior | None]) -> SpeedModelSettings:
    """Return the model with other priors of nuisance parameters; None fixes one at its own value."""
    theta = model.prior.theta
    nuisances = theta.nuisances.model_copy(update=dict(priors))
    prior = model.prior.model_copy(update={"theta": theta.model_copy(update={"nuisances": nuisances})})
    return model.model_copy(update={"prior": prior})
