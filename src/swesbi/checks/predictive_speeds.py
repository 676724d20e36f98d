"""Predictive checks of an experiment on speeds: the new recording that each draw would give."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from swesbi.base.arrays import FloatArray, rows_of
from swesbi.checks.draws import CheckedFeatures, Curves, make_draws, make_target
from swesbi.checks.predictive import Draws, Prediction, PredictiveCheck, Target, log_scores
from swesbi.checks.scores import NO_COVERAGES, NO_SCORES, Band, FeatureCheck, band, cover, coverage, score
from swesbi.checks.settings import PredictiveSettings
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
class Replicates:
    """Predictive draws and a new recording of each.

    Attributes:
        draws: Parameters, noiseless curves, and what a cardiologist reads.
        noisy: The new recordings: measurement noise and discrepancy.
        measured: The same draws with measurement noise alone, as if the model were exact.
    """

    draws: Draws
    noisy: Curves
    measured: Curves


@dataclass(frozen=True)
class Recorder:
    """One subject's model with what its recordings are read by."""

    model: SpeedModel
    observation: Observation
    features: CheckedFeatures

    def curves(self, speed_m_s: FloatArray) -> Curves:
        """Turn speeds (n, p) at the measured phases into curves, like ingestion: E = 3 rho c^2, the grid."""
        settings, phase = self.model.settings, self.model.recording.phase
        stiffness = youngs_modulus_kpa(speed_m_s, settings.density_kg_m3)
        full = np.full((len(stiffness), len(self.observation.phase)), np.nan)
        full[:, self.observation.measured] = stiffness
        grid = to_grid(phase, stiffness, settings.measurement.grid_points)
        return Curves(full, grid, self.features.of(grid))

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
        return make_target(observation, self.features, se, noise_sd)


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
    shown = predict_recordings(after, target, settings.interval)
    return PredictiveCheck(
        target=target,
        interval=settings.interval,
        may_be_read=may_be_read,
        prior=predict_recordings(prior, target, settings.interval),
        posterior=shown if may_be_read else withheld(shown),
    )


def feature_noise_sd(made: Replicates) -> FloatArray:
    """Return the standard deviation of what noise and discrepancy do to the features; shape (features,)."""
    return np.asarray((made.noisy.features - made.draws.features).std(axis=0))


def _record(
    phi: FloatArray,
    predicted: PredictedSpeeds,
    volumes_ml: tuple[FloatArray, FloatArray],
    failed: int,
    recorder: Recorder,
    rng: np.random.Generator,
) -> Replicates:
    model = recorder.model
    clean = recorder.curves(predicted.speed_m_s)
    errors, discrepancy = model.recording.errors, model.settings.discrepancy
    return Replicates(
        draws=make_draws(phi[:, OF_THETA], clean, volumes_ml, model.activation_duration_s(phi), failed),
        noisy=recorder.curves(draw_speeds(predicted, errors, discrepancy, rng)),
        measured=recorder.curves(draw_speeds(predicted, errors, NO_DISCREPANCY, rng)),
    )


def predict_recordings(made: Replicates, target: Target, interval: float) -> Prediction:
    """Compare predictive draws of an experiment on speeds with the observation.

    Medians are those of the noiseless curves, intervals those of new recordings: a measured phase should
    lie inside with the interval's probability; ``coverages`` count the band of noiseless curves too.
    ``coverage_recording_noise`` is the coverage with measurement noise alone, the discrepancy left out.

    Args:
        made: n draws, n > 0.
        target: The observation.
        interval: Probability mass of the central intervals.
    """
    measured = target.measured
    curve = noisy_band(made.draws.curve_kpa, made.noisy.curve_kpa, interval)
    phases = noisy_band(made.draws.phase_kpa, made.noisy.phase_kpa, interval)
    observed = target.stiffness_kpa[measured]
    shown = made.draws.phase_kpa[:, measured], made.noisy.phase_kpa[:, measured]
    alone = band(made.measured.phase_kpa[:, measured], interval)
    return Prediction(
        draws=made.draws,
        curve=curve,
        phases=phases,
        features=FeatureCheck(target.features, band(made.noisy.features, interval)),
        scores=score(target.grid, target.curve_kpa, curve),
        phase_scores=score(target.phase[measured], observed, rows_of(phases, measured)),
        coverage_recording_noise=coverage(observed, alone),
        observed=band(made.noisy.curve_kpa, interval),
        coverages=cover(target.curve_kpa, made.draws.curve_kpa, made.noisy.curve_kpa, interval),
        phase_coverages=cover(observed, *shown, interval),
    )


def noisy_band(noiseless: FloatArray, noisy: FloatArray, interval: float) -> Band:
    """Return the median of noiseless curves within the interval of noisy ones, (n, points) each."""
    ends = band(noisy, interval)
    return Band(band(noiseless, interval).median, ends.low, ends.high)


def withheld(prediction: Prediction) -> Prediction:
    """Return the prediction of a subject whose posterior is not reported: curves, but no scores."""
    return replace(
        prediction,
        scores=NO_SCORES,
        phase_scores=NO_SCORES,
        coverage_recording_noise=NO_SCORES.coverage,
        coverages=NO_COVERAGES,
        phase_coverages=NO_COVERAGES,
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
