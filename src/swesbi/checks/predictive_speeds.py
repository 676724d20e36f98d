"""Predictive checks of an experiment on speeds: the new recording that each draw would give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.predictive import (
    CheckedFeatures,
    Draws,
    PredictiveCheck,
    Replicates,
    Target,
    log_scores,
    predict,
    withheld,
)
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, draw_speeds, speed_model
from swesbi.measurement.settings import DiscrepancySettings, SummarySettings
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.parameters import OF_THETA
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import sample
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.phases import to_grid
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
    predicted = model.predict_from(phi, beats)
    good = beats.status == Status.PERIODIC
    volumes = (beats.end_diastolic_volume_ml[good], beats.end_systolic_volume_ml[good])
    kept = PredictedSpeeds(predicted.log_speed[good], predicted.slope[good])
    return _record(phi[good], kept, volumes, int((~good).sum()), recorder, rng)


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
    volumes = (simulations.end_diastolic_volume_ml[:number], simulations.end_systolic_volume_ml[:number])
    return _record(phi, predicted, volumes, 0, recorder, rng)


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
    """Compare a recording with what prior and posterior predict of new ones.

    New recordings are drawn under the whole observation model: measurement noise and discrepancy. A
    contradicted subject keeps its predictive curves, which show what the model cannot do, but has no scores.

    Args:
        recorder: The recording and its model.
        phi: Draws of the exact posterior; shape (n, d).
        prior: New recordings of draws of the prior.
        settings: Gives how many draws are taken, and the interval.
        seed: The study's seed.
        may_be_read: Whether the verdict lets the posterior be read.

    Raises:
        ValueError: Every posterior draw failed in the simulator.
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
    volumes_ml: tuple[FloatArray, FloatArray],
    failed: int,
    recorder: Recorder,
    rng: np.random.Generator,
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
            end_diastolic_volume_ml=volumes_ml[0],
            end_systolic_volume_ml=volumes_ml[1],
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

    Args:
        posterior: Of the subject.
        verdict: Whether it may be read.
        observation: The recording.
        noise: Of the cohort.
        shards: Simulations of the subject's prior.
        model: Of the recording.
        summary: Of which the checked features are some.
        predictive: How many draws, and the interval.
        seed: Of the new recordings.

    Raises:
        ValueError: Every posterior draw failed in the simulator.
    """
    features = CheckedFeatures(predictive.features, summary)
    recorder = Recorder(speed_model(observation, noise, model), observation, features)
    before = prior_recordings(shards, predictive.draws, recorder, stream_of(recorder, seed, "prior"))
    readable = verdict.may_be_read
    check = predictive_check(recorder, posterior.phi, before, predictive, seed, may_be_read=readable)
    log_scores(observation.subject, check)
    return check
