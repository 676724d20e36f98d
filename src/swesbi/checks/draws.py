"""Predictive draws of one subject as it was measured, their scores, and what they are compared with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.predictive import Draws, Target
from swesbi.checks.scores import Scores, band, score
from swesbi.heart.model import activation_duration_s, isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.settings import SummarySettings, summary_names
from swesbi.measurement.summary import summarise
from swesbi.parameters import THETA
from swesbi.recording.observation import Observation


def simulated_curves(
    theta: FloatArray, subject: MeasuredSubject, forward_model: ForwardModelSettings
) -> FloatArray:
    """Return the curves (n, grid) of theta (n, 3) in kPa; NaN where the simulation failed."""
    beats = simulate(theta, subject.observation.context, forward_model)
    good = beats.status == Status.PERIODIC
    curves = np.full((len(theta), subject.measurement.grid_points), np.nan)
    if good.any():
        curves[good] = subject.on_grid(beats.cycle_phase, beats.active_stiffness_kpa[good])
    return curves


@dataclass(frozen=True)
class CurveScores:
    """Scores of one predictive distribution against one recording; NaN where there is no draw."""

    grid: Scores
    phases: Scores


def score_theta(
    theta: FloatArray, subject: MeasuredSubject, forward_model: ForwardModelSettings, interval: float
) -> CurveScores:
    """Simulate theta (n, 3) and score the successful curves; n may be 0."""
    if len(theta) == 0:
        recording = subject.observation
        none = (np.empty((0, len(recording.grid))), np.empty((0, len(recording.phase))))
        return _score(*none, recording, interval)
    beats = simulate(theta, subject.observation.context, forward_model)
    good = beats.status == Status.PERIODIC
    return score_cycles(beats.cycle_phase, beats.active_stiffness_kpa[good], subject, interval)


def score_cycles(
    cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, subject: MeasuredSubject, interval: float
) -> CurveScores:
    """Score n successful simulations: phases of their cycle (M,), active stiffness (n, M).

    ``interval`` is the mass of the central predictive interval.
    """
    cycles = (cycle_phase, active_stiffness_kpa)
    return _score(subject.on_grid(*cycles), subject.at_phases(*cycles), subject.observation, interval)


def _score(grid: FloatArray, phases: FloatArray, recording: Observation, interval: float) -> CurveScores:
    phase, measured = recording.phase, recording.measured
    return CurveScores(
        grid=score(recording.grid, recording.curve_kpa, band(grid, interval)),
        phases=score(phase[measured], recording.stiffness_kpa[measured], band(phases[:, measured], interval)),
    )


class FeatureError(ValueError):
    """A feature to check that the summary does not have."""


@dataclass(frozen=True)
class CheckedFeatures:
    """The features that a check compares, by name, of those of a summary."""

    names: tuple[str, ...]
    summary: SummarySettings

    @property
    def columns(self) -> list[int]:
        """Where they stand in the summary.

        Raises:
            FeatureError: A name is no feature of the summary.
        """
        names = summary_names(self.summary)
        if unknown := [name for name in self.names if name not in names]:
            raise FeatureError(
                f"predictive.features: {unknown[0]!r} is no feature of the summary; it has {', '.join(names)}"
            )
        return [names.index(name) for name in self.names]

    def of(self, curve_kpa: FloatArray) -> FloatArray:
        """Return the features (n, features) of curves (n, grid); errors as of ``columns``."""
        return summarise(curve_kpa, self.summary)[:, self.columns]


@dataclass(frozen=True)
class Curves:
    """n stiffness curves as a recording shows them.

    Attributes:
        phase_kpa: At the phases of the recording; shape (n, phases).
        curve_kpa: On the analysis grid, through the measurement operator; shape (n, grid).
        features: Their checked features; shape (n, features).
    """

    phase_kpa: FloatArray
    curve_kpa: FloatArray
    features: FloatArray


def make_target(
    observation: Observation, features: CheckedFeatures, se_kpa: FloatArray, noise_sd: FloatArray
) -> Target:
    """Return what predictions are compared with.

    Args:
        observation: The recording.
        features: The features compared.
        se_kpa: Standard errors of its stiffness; shape (phases,).
        noise_sd: Standard deviation of what noise does to the features; shape (features,).

    Raises:
        FeatureError: A name is no feature of the summary.
    """
    return Target(
        grid=observation.grid,
        curve_kpa=observation.curve_kpa,
        phase=observation.phase,
        measured=observation.measured,
        stiffness_kpa=observation.stiffness_kpa,
        stiffness_se_kpa=se_kpa,
        features=features.of(observation.curve_kpa[None])[0],
        feature_names=features.names,
        feature_noise_sd=noise_sd,
        lvedv_ml=observation.context.lvedv_ml,
        lvesv_ml=observation.context.lvesv_ml,
    )


def make_draws(
    theta: FloatArray,
    curves: Curves,
    volumes_ml: tuple[FloatArray, FloatArray],
    activation_duration_s: FloatArray | float,
    failed: int = 0,
) -> Draws:
    """Return n predictive draws: theta (n, 3), noiseless curves, largest and smallest cavity volumes (n,)."""
    return Draws(
        theta=theta,
        curve_kpa=curves.curve_kpa,
        phase_kpa=curves.phase_kpa,
        features=curves.features,
        end_diastolic_volume_ml=volumes_ml[0],
        end_systolic_volume_ml=volumes_ml[1],
        isometric_stiffness_kpa=isometric_stiffness_kpa(theta, activation_duration_s),
        failed=failed,
    )


@dataclass(frozen=True)
class FeatureModel:
    """One subject under an experiment on features: it makes predictive draws of it."""

    subject: MeasuredSubject
    forward_model: ForwardModelSettings
    features: CheckedFeatures

    def from_prior(self, simulations: PriorSimulations, number: int) -> Draws:
        """Return the first ``number`` stored, successful prior simulations as predictive draws."""
        volumes = (simulations.end_diastolic_volume_ml[:number], simulations.end_systolic_volume_ml[:number])
        cycles = (simulations.cycle_phase, simulations.active_stiffness_kpa[:number])
        return self._draws(simulations.theta[:number], cycles, volumes)

    def from_theta(self, theta: FloatArray) -> Draws:
        """Simulate theta (n, 3) and return the successful ones as predictive draws; n may be 0."""
        if len(theta) == 0:
            return self._no_draws(failed=0)
        beats = simulate(theta, self.subject.observation.context, self.forward_model)
        good = beats.status == Status.PERIODIC
        if not good.any():
            return self._no_draws(failed=len(theta))
        cycles = (beats.cycle_phase, beats.active_stiffness_kpa[good])
        volumes = (beats.end_diastolic_volume_ml[good], beats.end_systolic_volume_ml[good])
        return self._draws(theta[good], cycles, volumes, int((~good).sum()))

    @property
    def _duration_s(self) -> float:
        return activation_duration_s(self.subject.observation.context.period_s, self.forward_model)

    def _draws(
        self,
        theta: FloatArray,
        cycles: tuple[FloatArray, FloatArray],
        volumes_ml: tuple[FloatArray, FloatArray],
        failed: int = 0,
    ) -> Draws:
        grid = self.subject.on_grid(*cycles)
        curves = Curves(self.subject.at_phases(*cycles), grid, self.features.of(grid))
        return make_draws(theta, curves, volumes_ml, self._duration_s, failed)

    def _no_draws(self, failed: int) -> Draws:
        sizes = len(self.subject.observation.phase), self.subject.measurement.grid_points
        curves = Curves(*(np.empty((0, size)) for size in (*sizes, len(self.features.names))))
        none = np.empty(0)
        return make_draws(np.empty((0, len(THETA))), curves, (none, none), self._duration_s, failed)
