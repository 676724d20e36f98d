"""The likelihood of measured speeds, and a subject's recording under it.

Given phi, the log speeds of a gated recording are normal with covariance diag(s^2) + W W^T: s^2 is the
variance of what each phase has for itself, noise and discrepancy, and W the factor of what the phases of a
sweep share (``shared_error``). Pushes share what the model misses in a cell of the cycle (``instants``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from swesbi.artefacts import UnfitError
from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.heart.model import duration_ratio
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate, simulate_active
from swesbi.measurement import speeds
from swesbi.measurement.operator import (
    PassiveBaseline,
    active_stiffness_map,
    total_at_phases,
    total_curves,
)
from swesbi.measurement.settings import (
    DiscrepancySettings,
    MeasurementSettings,
    SummarySettings,
)
from swesbi.measurement.shared_error import (
    CellData,
    CellErrors,
    Errors,
    Innovations,
    cell_innovations,
    cell_sums,
    draw_shared,
    error_factors,
    innovations,
    likeliest_factor,
)
from swesbi.measurement.summary import summarise
from swesbi.parameters import OF_THETA, OPERATOR_NAMES, STRETCHED
from swesbi.prior import JointPriorSettings, PriorSettings, log_centre
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.noise.errors import MeanErrors
from swesbi.recording.observation import Observation


def log_speed_sd(
    predicted: speeds.PredictedSpeeds, relative_se: FloatArray, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return the standard deviation of what each measured log speed has for itself; shape (n, p).

    sd^2 = se^2 + delta^2 + (tau d log c / ds)^2: the relative standard error of the mean speed, without what
    phases share, the model's relative error, and its error in phase carried over by the slope (first order).
    """
    timing = discrepancy.timing_cycle * predicted.slope
    return np.asarray(np.sqrt(relative_se**2 + discrepancy.speed_fraction**2 + timing**2))


def standardise(
    predicted: speeds.PredictedSpeeds, recording: speeds.SpeedRecording, discrepancy: DiscrepancySettings
) -> Innovations:
    """Return log c_obs - log c at the measured points, each given the points before it; (n, p)."""
    if recording.cell is not None:
        return cell_innovations(_in_cells(predicted, recording, discrepancy))
    sd = log_speed_sd(predicted, recording.relative_se, discrepancy)
    return innovations(np.log(recording.speed_m_s) - predicted.log_speed, sd, recording.shared)


def _in_cells(
    predicted: speeds.PredictedSpeeds, recording: speeds.SpeedRecording, discrepancy: DiscrepancySettings
) -> CellData:
    """Return the log speeds of pushes about n predictions, with the errors of their cells."""
    distance, missed = np.log(recording.speed_m_s) - predicted.log_speed, discrepancy
    se, cell = recording.relative_se, recording.cells
    return CellData(distance, predicted.slope, se, cell, missed.speed_fraction, missed.timing_cycle)


def residuals(
    predicted: speeds.PredictedSpeeds, recording: speeds.SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return residuals at the measured points that are independent standard normals at the true phi; (n, p).

    They are (log c_obs - log c) / sd, where points share errors those of each point given the points before,
    and where a factor of all errors is not known those of its prior median.
    """
    return standardise(predicted, recording, discrepancy).z


def log_joint(
    predicted: speeds.PredictedSpeeds, recording: speeds.SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return log p(log c_obs | phi, lambda_k), and the log weight of lambda_k, a factor of errors; (k, n)."""
    if recording.cell is None:
        return standardise(predicted, recording, discrepancy).log_density[None]
    factors, log_weight = error_factors(recording.errors_log_sd, len(recording.phase))
    sums = cell_sums(_in_cells(predicted, recording, discrepancy))
    return np.stack([sums.log_density(factor) for factor in factors]) + log_weight[:, None]


def log_likelihood(
    predicted: speeds.PredictedSpeeds, recording: speeds.SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return log p(log c_obs | phi) of n simulations at the measured points; shape (n,).

    Simulations that failed (NaN) have likelihood zero.
    """
    total = logsumexp(log_joint(predicted, recording, discrepancy), axis=0)
    return np.where(np.isnan(total), -np.inf, total)


def draw_speeds(
    predicted: speeds.PredictedSpeeds,
    errors: MeanErrors,
    discrepancy: DiscrepancySettings,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw one recording's speeds (n, p), in m/s, for each of n simulations.

    The errors are one recording's (p, ...) for all, or one each (n, p, ...). What phases share is drawn last,
    once a recording and sweep.
    """
    sd = log_speed_sd(predicted, errors.own, discrepancy)
    own = sd * rng.standard_normal(sd.shape)
    return np.asarray(np.exp(predicted.log_speed + own + draw_shared(errors.shared, len(sd), rng)))


class SpeedModelSettings(Settings):
    """Everything that the model of a recording depends on; the stages of an experiment on speeds share it."""

    prior: JointPriorSettings
    discrepancy: DiscrepancySettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    density_kg_m3: float

    def physiology(self, phi: FloatArray) -> Physiology | None:
        """Return the physiology that phi (n, d) gives n simulations; None where none of it is free."""
        values, names = self.prior.physiology(phi), self.prior.theta.physiology_names
        return Physiology.of_nuisances(values, names, self.forward_model)

    def measured_by(self, phi: FloatArray) -> speeds.MeasuredBy:
        """Return what turns the wall of simulations of phi (n, d) into speeds."""
        ratio, middle_factor, speed_scale = (self.prior.column(phi, name) for name in OPERATOR_NAMES)
        return speeds.MeasuredBy(
            stretched_kpa=phi[:, STRETCHED],
            ratio=1.0 if ratio is None else ratio,
            middle_factor=1.0 if middle_factor is None else middle_factor,
            speed_scale=1.0 if speed_scale is None else speed_scale,
        )

    def predict(self, phi: FloatArray, wall: speeds.WallPhases) -> speeds.PredictedSpeeds:
        """Return the noiseless log speeds of simulations of phi (n, d) whose walls are given."""
        return speeds.predict_speeds(self.measured_by(phi), wall, self.density_kg_m3)


@dataclass(frozen=True)
class SpeedModel:
    """One recording under the settings of an experiment."""

    recording: speeds.SpeedRecording
    settings: SpeedModelSettings

    def activation_duration_s(self, phi: FloatArray) -> FloatArray:
        """Return the duration D_T of activation at the subject's heart rate, for phi (n, d); shape (n,)."""
        duration_s = self.settings.prior.column(phi, "activation_duration_s")
        if duration_s is None:
            duration_s = np.full(len(phi), self.settings.forward_model.activation_duration_s)
        return duration_s * duration_ratio(self.recording.context.period_s, self.settings.forward_model)

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi of shape (n, d) in the subject's context; failed rows hold NaN."""
        return simulate(*self._simulated(phi))

    def predict(self, phi: FloatArray) -> speeds.PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, d) at the measured phases; NaN where it failed."""
        return self.predict_at(phi, self.wall(phi))

    def predict_from(self, phi: FloatArray, cycles: speeds.WallCycles) -> speeds.PredictedSpeeds:
        """Return the noiseless log speeds of simulated cycles of phi (n, d); NaN gives NaN."""
        return self.predict_at(phi, self.wall_at_phases(cycles))

    def wall(self, phi: FloatArray) -> speeds.WallPhases:
        """Simulate phi (n, d) and return its wall at the measured phases; NaN where it failed."""
        return self.wall_at_phases(simulate_active(*self._simulated(phi)))

    def wall_at_phases(self, cycles: speeds.WallCycles) -> speeds.WallPhases:
        """Take simulated cycles at the measured phases."""
        map_name = self.settings.measurement.active_stiffness_map
        return speeds.wall_at_phases(cycles, self.recording.phase, map_name)

    def predict_at(self, phi: FloatArray, wall: speeds.WallPhases) -> speeds.PredictedSpeeds:
        """Return the noiseless log speeds of simulations of phi (n, d) taken at the measured phases."""
        return self.settings.predict(phi, wall)

    def speed_scale(self, phi: FloatArray) -> FloatArray:
        """Return the scale of the speeds of phi (n, d), 1 where it is fixed; shape (n,)."""
        return np.broadcast_to(self.settings.measured_by(phi).speed_scale, len(phi))

    def parts(self, phi: FloatArray, cycles: speeds.WallCycles) -> tuple[FloatArray, FloatArray]:
        """Return passive and active stiffness in kPa of simulations of phi (n, d); (n, M) each."""
        passive = self.settings.measured_by(phi).passive_kpa(speeds.shortening(cycles.stretch))
        active = active_stiffness_map(self.settings.measurement.active_stiffness_map)
        return passive, active(cycles.active_stiffness_kpa)

    def stiffness(self, phi: FloatArray, cycles: speeds.WallCycles) -> FloatArray:
        """Return the stiffness in kPa that the speeds of simulations of phi (n, d) show; shape (n, M)."""
        passive, active = self.parts(phi, cycles)
        return self.speed_scale(phi)[:, None] ** 2 * (passive + active)

    def _simulated(
        self, phi: FloatArray
    ) -> tuple[FloatArray, Context, ForwardModelSettings, Physiology | None]:
        settings = self.settings
        physiology = settings.physiology(phi)
        return phi[:, OF_THETA], self.recording.context, settings.forward_model, physiology

    def standardised(self, phi: FloatArray) -> FloatArray:
        """Return residuals of phi (n, d) that are standard normals at the true phi; (n, p), NaN: failed."""
        return self.standardised_of(self.predict(phi))

    def standardised_of(self, predicted: speeds.PredictedSpeeds) -> FloatArray:
        """Return the same of predicted speeds."""
        return residuals(predicted, self.recording, self.settings.discrepancy)

    def errors_of(self, predicted: speeds.PredictedSpeeds) -> Errors | CellErrors:
        """Return the errors of the log speeds about n predictions; NaN where the simulation failed.

        Where a factor of all errors is not known, it is the likeliest of each prediction.
        """
        recording, missed = self.recording, self.settings.discrepancy
        if recording.cell is None:
            return Errors(log_speed_sd(predicted, recording.relative_se, missed), recording.shared)
        chi_squared = cell_sums(_in_cells(predicted, recording, missed)).chi_squared()
        likeliest = likeliest_factor(chi_squared, len(recording.phase), recording.errors_log_sd)
        sd = np.hypot(likeliest[:, None] * recording.relative_se, missed.timing_cycle * predicted.slope)
        return CellErrors(sd, recording.cell, missed.speed_fraction)

    def draw_factor(self, predicted: speeds.PredictedSpeeds, rng: np.random.Generator) -> FloatArray:
        """Draw the factor of the errors given the recording and each of n simulations; shape (n,).

        Nothing is drawn where the errors are known.
        """
        if not self.recording.errors_log_sd:
            return np.ones(len(predicted.log_speed))
        factors, _ = error_factors(self.recording.errors_log_sd, len(self.recording.phase))
        joint = log_joint(predicted, self.recording, self.settings.discrepancy)
        below = np.cumsum(np.exp(joint - logsumexp(joint, axis=0)), axis=0) < rng.random(joint.shape[1])
        return np.asarray(factors[below.sum(axis=0).clip(max=len(factors) - 1)])

    def draw_speeds(self, predicted: speeds.PredictedSpeeds, rng: np.random.Generator) -> FloatArray:
        """Draw the speeds (n, p), in m/s, of new recordings at the same points, one of each simulation.

        The factor of the errors is drawn from its posterior, where it is not known; what the model misses is
        one in each cell, as in the likelihood.
        """
        recording, discrepancy = self.recording, self.settings.discrepancy
        if recording.cell is None:
            return draw_speeds(predicted, recording.errors, discrepancy, rng)
        _, place = np.unique(recording.cell, return_inverse=True)
        level, timing = rng.standard_normal((2, len(predicted.log_speed), place.max() + 1))
        own = rng.standard_normal(predicted.log_speed.shape) * recording.relative_se
        missed = discrepancy.speed_fraction * level[:, place]
        missed = missed + discrepancy.timing_cycle * predicted.slope * timing[:, place]
        factor = self.draw_factor(predicted, rng)[:, None]
        return np.asarray(np.exp(predicted.log_speed + missed + factor * own))

    def chi_squared(self, predicted: speeds.PredictedSpeeds, rng: np.random.Generator) -> FloatArray:
        """Return the sum of squared residuals of n simulations, each by a drawn factor of errors; (n,)."""
        if self.recording.cell is None:
            return standardise(predicted, self.recording, self.settings.discrepancy).chi_squared
        sums = cell_sums(_in_cells(predicted, self.recording, self.settings.discrepancy))
        return sums.chi_squared(self.draw_factor(predicted, rng))

    def likeliest_residuals(self, predicted: speeds.PredictedSpeeds) -> FloatArray:
        """Return the standardised residuals of the likeliest of n simulations; (p,)."""
        best = predicted.rows(np.array([np.argmax(self.log_likelihood_of(predicted))]))
        return np.asarray(self.standardised_of(best)[0])

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of shape (n,); -inf where the simulation failed."""
        return self.log_likelihood_of(self.predict(phi))

    def log_likelihood_of(self, predicted: speeds.PredictedSpeeds) -> FloatArray:
        """Return the same of predicted speeds."""
        return log_likelihood(predicted, self.recording, self.settings.discrepancy)


@dataclass(frozen=True)
class MeasuredSubject:
    """One subject's recording, passive baseline and measurement operator.

    Its methods take simulated cycles: their M phases (M,), and n active stiffnesses in kPa (n, M).
    """

    observation: Observation
    passive: PassiveBaseline
    measurement: MeasurementSettings

    def on_grid(self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray) -> FloatArray:
        """Return total curves (n, grid) in kPa, measured at the subject's measured phases (paper, Eq. 3)."""
        return total_curves(
            (cycle_phase, active_stiffness_kpa), self.passive, self.observation, self.measurement
        )

    def at_phases(self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray) -> FloatArray:
        """Return total stiffness (n, phases) in kPa at every phase of the recording."""
        return total_at_phases(
            (cycle_phase, active_stiffness_kpa), self.passive, self.observation, self.measurement
        )

    def observed_features(self, summary: SummarySettings) -> FloatArray:
        """Return x_obs = S(E_obs) of shape (F,) (paper, Eq. 4)."""
        features: FloatArray = summarise(self.observation.curve_kpa[None], summary)[0]
        return features

    def simulated_features(
        self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, summary: SummarySettings
    ) -> FloatArray:
        """Return x = S(E_sim) of shape (n, F) (paper, Eq. 4)."""
        return summarise(self.on_grid(cycle_phase, active_stiffness_kpa), summary)


def measured_subjects(
    observations: Sequence[Observation],
    passives: Mapping[str, PassiveBaseline],
    measurement: MeasurementSettings,
) -> tuple[MeasuredSubject, ...]:
    """Put each recording together with the passive baseline of its subject, in the order of recordings."""
    names = [recording.subject for recording in observations]
    if sorted(names) != sorted(passives):
        raise UnfitError(
            "passives",
            f"are of {sorted(passives)}, the observations of {names}; each subject needs one of each",
        )
    return tuple(
        MeasuredSubject(recording, passives[recording.subject], measurement) for recording in observations
    )


def reference_beat(context: Context, prior: PriorSettings, forward_model: ForwardModelSettings) -> Beats:
    """Return the beat at the prior's log-centre, along which a fixed passive stiffness runs."""
    return simulate(log_centre(prior)[None, :], context, forward_model)


def speed_model(observation: Observation, noise: CohortNoise, settings: SpeedModelSettings) -> SpeedModel:
    """Return the model of a recording whose errors are those of its group."""
    return SpeedModel(speeds.measured_speeds(observation, noise.of(observation.subject)), settings)


def simulate_draws(model: SpeedModel, phi: FloatArray) -> Beats:
    """Simulate draws of a posterior (n, d), those that repeat each other once."""
    distinct, place = np.unique(phi, axis=0, return_inverse=True)
    return model.simulate(distinct).rows(place.ravel())


def predict_draws(model: SpeedModel, phi: FloatArray) -> speeds.PredictedSpeeds:
    """Return the noiseless log speeds of draws of a posterior (n, d), as :func:`simulate_draws` does."""
    distinct, place = np.unique(phi, axis=0, return_inverse=True)
    return model.predict(distinct).rows(place.ravel())
