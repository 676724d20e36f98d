"""The forward model of one subject as it was measured, and predictive draws from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.checks.predictive import Draws, Target
from swesbi.checks.scores import Scores, band, score
from swesbi.heart.model import activation_duration_s, attained_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.operator import PassiveBaseline, total_at_phases, total_curves
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names
from swesbi.measurement.summary import summarise
from swesbi.networks.paper.pool import noise_sd
from swesbi.networks.settings import ObservationModelSettings
from swesbi.parameters import THETA
from swesbi.recording.observation import Observation
from swesbi.simulations import PriorSimulations

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


@dataclass(frozen=True)
class CurveScores:
    """Scores of one predictive distribution against one recording; NaN where there is no draw."""

    grid: Scores
    phases: Scores


def score_theta(theta: FloatArray, model: SubjectModel, interval: float) -> CurveScores:
    """Simulate theta (n, 3) and score the successful curves; n may be 0."""
    if len(theta) == 0:
        return _score(np.empty((0, len(model.observation.grid))), _no_phases(model), model, interval)
    beats = model.simulate(theta)
    good = beats.status == Status.PERIODIC
    return score_cycles(beats.cycle_phase, beats.active_stiffness_kpa[good], model, interval)


def score_cycles(
    cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, model: SubjectModel, interval: float
) -> CurveScores:
    """Score simulated cycles.

    Args:
        cycle_phase: (M,) phases of the simulated cycle.
        active_stiffness_kpa: (n, M) active stiffness of successful simulations.
        model: Recording, passive baseline and measurement operator.
        interval: Mass of the central predictive interval.
    """
    cycles = (cycle_phase, active_stiffness_kpa)
    return _score(model.on_grid(*cycles), model.at_phases(*cycles), model, interval)


def _score(grid: FloatArray, phases: FloatArray, model: SubjectModel, interval: float) -> CurveScores:
    recording = model.observation
    measured = recording.measured
    return CurveScores(
        grid=score(recording.grid, recording.curve_kpa, band(grid, interval)),
        phases=score(
            recording.phase[measured],
            recording.stiffness_kpa[measured],
            band(phases[:, measured], interval),
        ),
    )


def _no_phases(model: SubjectModel) -> FloatArray:
    return np.empty((0, len(model.observation.phase)))


class FeatureError(ValueError):
    """A feature to check that the summary does not have."""


def make_target(
    model: SubjectModel,
    feature_names: tuple[str, ...],
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
) -> Target:
    """Return what the predictions of a subject are compared with.

    Raises:
        FeatureError: A name is no feature of the summary.
    """
    observation = model.observation
    columns = feature_columns(feature_names, summary)
    sd = noise_sd(summary_names(summary), observation_model.feature_noise_sd)
    return Target(
        grid=observation.grid,
        curve_kpa=observation.curve_kpa,
        phase=observation.phase,
        measured=observation.measured,
        stiffness_kpa=observation.stiffness_kpa,
        stiffness_se_kpa=observation.stiffness_se_kpa,
        features=summarise(observation.curve_kpa[None], summary)[0, columns],
        feature_names=feature_names,
        feature_noise_sd=sd[columns],
        lvedv_ml=observation.context.lvedv_ml,
        lvesv_ml=observation.context.lvesv_ml,
    )


def from_prior(
    simulations: PriorSimulations,
    model: SubjectModel,
    feature_names: tuple[str, ...],
    summary: SummarySettings,
    number: int,
) -> Draws:
    """Return the first ``number`` stored, successful prior simulations as predictive draws."""
    volumes = (simulations.end_diastolic_volume_ml[:number], simulations.end_systolic_volume_ml[:number])
    cycles = (simulations.cycle_phase, simulations.active_stiffness_kpa[:number])
    return _measure(simulations.theta[:number], cycles, volumes, 0, model, feature_names, summary)


def from_theta(
    theta: FloatArray, model: SubjectModel, feature_names: tuple[str, ...], summary: SummarySettings
) -> Draws:
    """Simulate theta of shape (n, 3) and return the successful ones as predictive draws; n may be 0."""
    if len(theta) == 0:
        return _no_draws(model, len(feature_names))
    beats = model.simulate(theta)
    good = beats.status == Status.PERIODIC
    if not good.any():
        return _no_draws(model, len(feature_names), failed=len(theta))
    cycles = (beats.cycle_phase, beats.active_stiffness_kpa[good])
    volumes = (beats.end_diastolic_volume_ml[good], beats.end_systolic_volume_ml[good])
    failed = int((~good).sum())
    return _measure(theta[good], cycles, volumes, failed, model, feature_names, summary)


def _measure(
    theta: FloatArray,
    cycles: tuple[FloatArray, FloatArray],
    volumes_ml: tuple[FloatArray, FloatArray],
    failed: int,
    model: SubjectModel,
    feature_names: tuple[str, ...],
    summary: SummarySettings,
) -> Draws:
    curves = model.on_grid(*cycles)
    return Draws(
        theta=theta,
        curve_kpa=curves,
        phase_kpa=model.at_phases(*cycles),
        features=summarise(curves, summary)[:, feature_columns(feature_names, summary)],
        end_diastolic_volume_ml=volumes_ml[0],
        end_systolic_volume_ml=volumes_ml[1],
        attained_stiffness_kpa=attained_stiffness_kpa(theta, model.activation_duration_s),
        failed=failed,
    )


def _no_draws(model: SubjectModel, features: int, failed: int = 0) -> Draws:
    return Draws(
        theta=np.empty((0, len(THETA))),
        curve_kpa=np.empty((0, model.measurement.grid_points)),
        phase_kpa=np.empty((0, len(model.observation.phase))),
        features=np.empty((0, features)),
        end_diastolic_volume_ml=np.empty(0),
        end_systolic_volume_ml=np.empty(0),
        attained_stiffness_kpa=np.empty(0),
        failed=failed,
    )


def feature_columns(feature_names: tuple[str, ...], summary: SummarySettings) -> list[int]:
    """Return where the named features stand in the summary.

    Raises:
        FeatureError: A name is no feature of the summary.
    """
    names = summary_names(summary)
    if unknown := [name for name in feature_names if name not in names]:
        raise FeatureError(
            f"predictive.features: {unknown[0]!r} is no feature of the summary; it has {', '.join(names)}"
        )
    return [names.index(name) for name in feature_names]
