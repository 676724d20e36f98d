"""Recovery of known parameters by the network of an experiment on features: its draws, scored by interval."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import WholeTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.table import coverage
from swesbi.checks.settings import RecoverySettings
from swesbi.context import Context
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject, measured_subjects, reference_beat
from swesbi.measurement.operator import PassiveBaseline, PassiveCalibrationError
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings, SummarySettings, summary_names
from swesbi.networks.paper.estimator import TrainedEstimator, draw_candidates
from swesbi.networks.paper.pool import Pool, augment, noise_sd, with_context
from swesbi.networks.settings import ObservationModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.population.recordings import Reacquisition
from swesbi.prior import PriorSettings, in_bounds, prior_variance
from swesbi.recording.observation import Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.seeds import generator, integer_seed

LOGGER = logging.getLogger("swesbi")


class NothingRecoveredError(ValueError):
    """No synthetic recording has enough draws within the prior's bounds; the message says what to do."""


def fresh_simulations(
    count: int, context: Context, prior: PriorSettings, forward_model: ForwardModelSettings, seed: int
) -> PriorSimulations:
    """Simulate theta that no training has seen: the prior's draws under another root of the streams.

    Every kind of recovery uses the same theta, so their scores can be compared.
    """
    return draw_simulations(range(count), context, prior, forward_model, integer_seed(seed, "recovery"))


def recover(
    truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> pd.DataFrame:
    """Return a row a recording and parameter: truth, its level, and the moments of the posterior.

    Truths are (N, 3), unfiltered candidates (N, S, 3). A recording with fewer than ``min_in_prior_draws`` of
    them in the prior's bounds has no posterior that the study would report: it is left out, and the number of
    recordings scored says so. None left is a NothingRecoveredError. The level is the share of the draws in
    bounds below the truth, ties counted by half.
    """
    inside = [draws[in_bounds(draws, prior)] for draws in candidates]
    scored = [i for i, draws in enumerate(inside) if len(draws) >= settings.min_in_prior_draws]
    if not scored:
        raise NothingRecoveredError(
            f"none of the {len(truth)} synthetic recordings has {settings.min_in_prior_draws} draws in the "
            "prior's bounds: the estimator has not learned the posterior; train it longer"
        )
    kept, known = [inside[i] for i in scored], truth[scored]
    below = [(d < t).mean(axis=0) + 0.5 * (d == t).mean(axis=0) for d, t in zip(kept, known, strict=True)]
    columns = {
        "truth": known,
        "level": np.stack(below),
        "mean": np.stack([draws.mean(axis=0) for draws in kept]),
        "variance": np.stack([draws.var(axis=0, ddof=1) for draws in kept]),
        "prior_variance": np.tile(prior_variance(prior), (len(kept), 1)),
    }
    labels = {"number": np.repeat(scored, len(THETA_NAMES)), "quantity": [*THETA_NAMES] * len(scored)}
    return pd.DataFrame(labels | {name: values.ravel() for name, values in columns.items()})


def shares(total: int, parts: int) -> list[int]:
    """Share ``total`` recordings out over ``parts`` subjects as evenly as can be, the first getting more."""
    return [len(part) for part in np.array_split(np.arange(total), parts)]


def own_recovery(
    pool: Pool,
    estimator: TrainedEstimator,
    observations: tuple[Observation, ...],
    passives: BySubject[PassiveBaseline],
    *,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    recovery: RecoverySettings,
    seed: int,
) -> WholeTable:
    """Simulate fresh theta from the prior in the cohort's contexts, infer them, and score the posteriors.

    Each recording has the context, the phases and the passive baseline of one subject, and the noise of the
    experiment's observation model.

    Raises:
        NothingRecoveredError: No recording has enough draws.
    """
    truth, raw = synthetic_recordings(
        measured_subjects(observations, passives, measurement),
        recovery.recordings,
        prior=prior,
        forward_model=forward_model,
        summary=summary,
        observation_model=observation_model,
        seed=seed,
    )
    return _scored("recovery", truth, inferred(pool, estimator, raw, recovery, seed), prior, recovery)


def synthetic_recordings(
    subjects: Sequence[MeasuredSubject],
    recordings: int,
    *,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    seed: int,
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and raw features with context (N, C) of N recordings shared over the subjects."""
    sd = noise_sd(summary_names(summary), observation_model.feature_noise_sd)

    def of_subject(subject: MeasuredSubject, simulations: PriorSimulations) -> tuple[FloatArray, FloatArray]:
        clean = subject.simulated_features(simulations.cycle_phase, simulations.active_stiffness_kpa, summary)
        rng = generator(seed, "recovery", "feature noise", subject.observation.subject)
        return simulations.theta, augment(clean, sd, 1, rng)[:, 0]

    return _shared(of_subject, subjects, recordings, prior, forward_model, seed)


def _shared(
    make: Callable[[MeasuredSubject, PriorSimulations], tuple[FloatArray, FloatArray]],
    subjects: Sequence[MeasuredSubject],
    recordings: int,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    seed: int,
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and raw features with context (N, C), made of fresh simulations of each subject."""
    truth, raw = [], []
    for subject, count in zip(subjects, shares(recordings, len(subjects)), strict=True):
        if count:
            context = subject.observation.context
            theta, features = make(subject, fresh_simulations(count, context, prior, forward_model, seed))
            truth.append(theta)
            raw.append(with_context(features, context))
    return np.concatenate(truth), np.concatenate(raw)


def posterior_seed(seed: int) -> int:
    """Return the seed of the draws that recordings are inferred with."""
    return integer_seed(seed, "recovery", "posterior")


def inferred(
    pool: Pool, estimator: TrainedEstimator, raw: FloatArray, recovery: RecoverySettings, seed: int
) -> FloatArray:
    """Draw candidates (N, draws, 3) for recordings given as raw features with context (N, C)."""
    pool.check_components(estimator.components, "estimator")
    z = pool.standardisation.apply(raw)
    return draw_candidates(estimator, z, recovery.candidate_draws, posterior_seed(seed))


def recovery_table(
    truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> pd.DataFrame:
    """Return how often intervals of candidates (N, draws, 3) contain theta (N, 3), by parameter and level."""
    return coverage(recover(truth, candidates, prior, settings), [], settings)


def _scored(
    name: str, truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> pd.DataFrame:
    table = recovery_table(truth, candidates, prior, settings)
    LOGGER.info("%s: %d of %d recordings scored", name, table["n"].max(), len(truth))
    for row in table.itertuples():
        LOGGER.info("  %s, nominal %.2f: coverage %.3f", row.parameter, row.nominal, row.coverage)
    return table


def acquisition_recovery(
    pool: Pool,
    estimator: TrainedEstimator,
    observations: tuple[Observation, ...],
    passives: BySubject[PassiveBaseline],
    *,
    prior: PriorSettings,
    reference_prior: PriorSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
    passive: PassiveSettings,
    recording: RecordingSettings,
    acquisition: AcquisitionSettings,
    summary: SummarySettings,
    recovery: RecoverySettings,
    seed: int,
) -> WholeTable:
    """Record fresh theta with acquisition noise, ingest, calibrate and infer each recording, and score.

    Theta are those of the recovery under the experiment's own observation model. A recording that ingestion
    or calibration refuses is not scored; the log says how many were.

    Raises:
        ValueError: Every recording was refused, or none has enough draws.
    """

    def of_subject(subject: MeasuredSubject, simulations: PriorSimulations) -> tuple[FloatArray, FloatArray]:
        reference = reference_beat(subject.observation.context, reference_prior, forward_model)
        maker = Reacquisition(subject, reference, acquisition, recording, passive, measurement, summary)
        return _acquired(maker, simulations, seed)

    subjects, tried = measured_subjects(observations, passives, measurement), recovery.recordings
    truth, raw = _shared(of_subject, subjects, tried, prior, forward_model, seed)
    LOGGER.info("%d of %d recordings passed ingestion and calibration", len(truth), tried)
    if not len(truth):
        raise ValueError(f"all {tried} synthetic recordings were refused; see the log for the reasons")
    candidates = inferred(pool, estimator, raw, recovery, seed)
    return _scored("recovery_acquisition", truth, candidates, prior, recovery)


def _acquired(
    maker: Reacquisition, simulations: PriorSimulations, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (n, 3) and features (n, F) of the recordings that passed."""
    name = maker.subject.observation.subject
    passed: list[int] = []
    features: list[FloatArray] = []
    for index, active in enumerate(simulations.active_stiffness_kpa):
        rng = generator(seed, "recovery", "acquisition", name, index)
        try:
            features.append(maker.features(simulations.cycle_phase, active, rng))
        except (RecordingError, PassiveCalibrationError) as error:
            LOGGER.info("subject %s, synthetic recording %d refused: %s", name, index, error)
        else:
            passed.append(index)
    stacked = np.array(features).reshape(len(passed), len(summary_names(maker.summary)))
    return simulations.theta[passed], stacked
