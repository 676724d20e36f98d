"""Predictive checks of an experiment on speeds: the new recording that each draw would give.

Of a free-running recording these are new pushes at its instants, and the curve behind them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.predictive import (
    CheckedFeatures,
    Draws,
    FreePredictiveCheck,
    PredictiveCheck,
    Replicates,
    Target,
    log_scores,
    predict,
    withheld,
)
from swesbi.checks.scores import band, coverage
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, draw_speeds, speed_model
from swesbi.measurement.settings import DiscrepancySettings, SummarySettings
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.parameters import OF_THETA
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import sample
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.phases import analysis_grid, to_grid
from swesbi.recording.speed import youngs_modulus_kpa
from swesbi.seeds import generator
from swesbi.verdict.verdict import Verdict

NO_DISCREPANCY = DiscrepancySettings(speed_fraction=0.0, timing_cycle=0.0)


@dataclass(frozen=True)
class Recorder:
    """One subject's model with what its recordings are read by."""

    model: SpeedModel
    observation: Observation
    features: CheckedFeatures

    def at_phases(self, speed_m_s: FloatArray) -> FloatArray:
        """Turn speeds (n, p) at measured phases into E = 3 rho c^2 at all of them, NaN where missing."""
        full = np.full((len(speed_m_s), len(self.observation.phase)), np.nan)
        full[:, self.observation.measured] = youngs_modulus_kpa(speed_m_s, self.model.settings.density_kg_m3)
        return full

    def on_grid(self, phase_kpa: FloatArray) -> FloatArray:
        """Turn stiffness at the phases into curves (n, grid), like ingestion."""
        points = self.model.settings.measurement.grid_points
        return to_grid(self.model.recording.phase, phase_kpa[:, self.observation.measured], points)

    def target(self, noise_sd: FloatArray) -> Target:
        """Return what predictions are compared with; standard errors are those of the observation model.

        ``noise_sd`` (features,) is the standard deviation of what noise does to the checked features.
        """
        observation = self.observation
        se = np.full(len(observation.phase), np.nan)
        # E is proportional to c^2: its relative error is twice that of the speed.
        se[observation.measured] = (
            2.0 * self.model.recording.errors.total * observation.stiffness_kpa[observation.measured]
        )
        return self.features.target(observation, se, noise_sd)


def new_recordings(phi: FloatArray, recorder: Recorder, rng: np.random.Generator) -> Replicates:
    """Simulate phi (n, d) and make a new recording of each successful simulation."""
    model = recorder.model
    beats = model.simulate(phi)
    good = beats.status == Status.PERIODIC
    predicted = model.predict_from(phi, beats).rows(good)
    return _record(phi[good], predicted, beats, good, recorder, rng, failed=int((~good).sum()))


def prior_recordings(
    simulations: PriorSimulations, number: int, recorder: Recorder, rng: np.random.Generator
) -> Replicates:
    """Make a new recording of each of the first ``number`` stored simulations."""
    model = recorder.model
    wall = model.wall_at_phases(simulations).rows(slice(number))
    prior = model.settings.prior
    operator = sample(len(wall.active_kpa), prior.operator, rng)
    phi = prior.joined(simulations.theta[:number], simulations.physiology[:number], operator)
    predicted = model.predict_at(phi, wall)
    return _record(phi, predicted, simulations, slice(number), recorder, rng)


def stream_of(recorder: Recorder, seed: int, part: str) -> np.random.Generator:
    """Return the random stream of a subject's new recordings; ``part`` is "prior" or "posterior"."""
    return generator(seed, "predictive speeds", recorder.observation.subject, part)


def predictive_check(
    recorder: Recorder,
    phi: FloatArray,
    prior: Replicates,
    settings: PredictiveSettings,
    seed: int,
    *,
    may_be_read: bool,
) -> PredictiveCheck:
    """Compare a recording with what prior and posterior draws (n, d) predict of new ones.

    New recordings are drawn under the whole observation model: measurement noise and discrepancy. A
    contradicted subject keeps its predictive curves, which show what the model cannot do, but has no scores.
    Refuses a posterior of which no draw can be simulated.
    """
    number, subject = settings.draws, recorder.observation.subject
    after = new_recordings(phi[:number], recorder, stream_of(recorder, seed, "posterior"))
    if not len(after.draws.theta):
        raise ValueError(f"subject {subject}: none of {len(phi[:number])} posterior draws can be simulated")
    target = recorder.target(feature_noise_sd(after))
    shown = predict(after, target, settings.interval, of_new=True)
    return PredictiveCheck(
        target=target,
        interval=settings.interval,
        may_be_read=may_be_read,
        prior=predict(prior, target, settings.interval, of_new=True),
        posterior=shown if may_be_read else withheld(shown),
    )


def feature_noise_sd(made: Replicates) -> FloatArray:
    """Return the standard deviation of what noise and discrepancy do to the features; shape (features,)."""
    return np.asarray((made.features - made.draws.features).std(axis=0))


def _record(
    phi: FloatArray,
    predicted: PredictedSpeeds,
    simulated: PriorSimulations | Beats,
    chosen: slice | BoolArray,
    recorder: Recorder,
    rng: np.random.Generator,
    failed: int = 0,
) -> Replicates:
    model, theta = recorder.model, phi[:, OF_THETA]
    errors, discrepancy = model.recording.errors, model.settings.discrepancy
    clean = recorder.at_phases(predicted.speed_m_s)
    grid = recorder.on_grid(clean)
    new = recorder.at_phases(draw_speeds(predicted, errors, discrepancy, rng))
    new_grid = recorder.on_grid(new)
    return Replicates(
        Draws(
            theta,
            curve_kpa=grid,
            phase_kpa=clean,
            features=recorder.features.of(grid),
            end_diastolic_volume_ml=simulated.end_diastolic_volume_ml[chosen],
            end_systolic_volume_ml=simulated.end_systolic_volume_ml[chosen],
            isometric_stiffness_kpa=isometric_stiffness_kpa(theta, model.activation_duration_s(phi)),
            failed=failed,
        ),
        curve_kpa=new_grid,
        phase_kpa=new,
        features=recorder.features.of(new_grid),
        measured_kpa=recorder.at_phases(draw_speeds(predicted, errors, NO_DISCREPANCY, rng)),
    )


def check_of_speeds(
    posterior: ExactPosterior,
    verdict: Verdict,
    observation: Observation,
    noise: CohortNoise,
    shards: PriorSimulations,
    *,
    model: SpeedModelSettings,
    summary: SummarySettings,
    predictive: PredictiveSettings,
    seed: int,
) -> PredictiveCheck:
    """Check the predictions of one subject in an experiment on speeds.

    Raises:
        ValueError: Every posterior draw failed in the simulator.
    """
    features = CheckedFeatures(predictive.features, summary)
    recorder = Recorder(speed_model(observation, noise, model), observation, features)
    before = prior_recordings(shards, predictive.draws, recorder, stream_of(recorder, seed, "prior"))
    check = predictive_check(
        recorder, posterior.phi, before, predictive, seed, may_be_read=verdict.may_be_read
    )
    log_scores(observation.subject, check)
    return check


def check_pushes(
    model: SpeedModel,
    phi: FloatArray,
    prior_phi: FloatArray,
    interval: float,
    grid_points: int,
    rng: np.random.Generator,
) -> FreePredictiveCheck:
    """Compare a recording with new pushes that its posterior would give at the same instants.

    Draws of the posterior are (n, d), of the prior (m, d); the errors of new pushes are drawn.
    """
    recording, density = model.recording, model.settings.density_kg_m3
    grid = analysis_grid(grid_points)
    curves, predicted = _predicted(model, phi, grid)
    prior, _ = _predicted(model, prior_phi, grid)
    observed = youngs_modulus_kpa(recording.speed_m_s, density)
    new = band(youngs_modulus_kpa(model.draw_speeds(predicted, rng), density), interval)
    return FreePredictiveCheck(
        grid=grid,
        prior=band(youngs_modulus_kpa(prior.speed_m_s, density), interval),
        posterior=band(youngs_modulus_kpa(curves.speed_m_s, density), interval),
        phase=recording.phase,
        stiffness_kpa=observed,
        relative_se=recording.relative_se,
        pushes=new,
        interval=interval,
        coverage=coverage(observed, new),
    )


def _predicted(
    model: SpeedModel, phi: FloatArray, grid: FloatArray
) -> tuple[PredictedSpeeds, PredictedSpeeds]:
    """Return the log speeds of the draws that can be simulated, on the grid and at the pushes."""
    beats = model.simulate(phi)
    on_grid = replace(model, recording=replace(model.recording, phase=grid)).predict_from(phi, beats)
    pushes = model.predict_from(phi, beats)
    good = np.flatnonzero(np.isfinite(pushes.log_speed).all(axis=1))
    return on_grid.rows(good), pushes.rows(good)
