"""Posteriors by the density estimator, and its recovery of known parameters."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, Origin, save, write_json
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.checks.recovery import fresh_simulations, recover, score_recovery, shares
from swesbi.checks.settings import RecoverySettings
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject, read_measured_subjects, reference_beat
from swesbi.measurement.operator import PassiveCalibrationError
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings, SummarySettings, summary_names
from swesbi.networks.paper.estimator import load_estimator
from swesbi.networks.paper.maf import Sampler, draw_candidates
from swesbi.networks.paper.pool import Pool, augment, noise_sd, read_pool, with_context
from swesbi.networks.settings import ObservationModelSettings
from swesbi.population.synthetic import Reacquisition
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import POSTERIOR, posterior_to_groups, summarise_posterior
from swesbi.prior import PriorSettings
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]


class PosteriorStageSettings(Settings):
    """What verdict and posterior depend on."""

    prior: PriorSettings
    support: SupportSettings
    posterior: PosteriorSettings


def posterior(
    *,
    pool: Path,
    estimator: Path,
    posterior: Path,
    verdict: Path,
    settings: PosteriorStageSettings,
    origin: Origin,
) -> None:
    """Draw candidates for ``origin.subject``, judge its prior support, keep the draws within the prior.

    A subject that is not prior-supported keeps its draws, if it has any, and its verdict.

    Raises:
        ArtefactError: The estimator was trained on other components than the pool's.
    """
    subject = origin.subject
    data, (trained, _) = read_pool(pool), load_estimator(estimator)
    check_components(data, trained, estimator)
    z_obs, names = data.observed_z(subject), data.components.names
    seed = integer_seed(origin.seed, "posterior", subject)
    candidates = draw_candidates(trained, z_obs[None], settings.support.candidate_draws, seed)[0]
    judged = diagnose(z_obs, names, candidates, settings.prior, settings.support)
    summary = summarise_posterior(candidates, z_obs, names, settings.prior, settings.posterior)
    save(posterior, posterior_to_groups(summary), origin.provenance(POSTERIOR, settings))
    write_json(verdict, judged.to_json())
    LOGGER.info("subject %s: %s", subject, judged.sentence)


def check_components(pool: Pool, estimator: Sampler, path: Path) -> None:
    """Refuse an estimator that was trained on other components than the pool's.

    Raises:
        ArtefactError: Names or order of the components differ.
    """
    if estimator.components != pool.components.names:
        raise ArtefactError(
            f"{path}: takes the components {', '.join(estimator.components)}; "
            f"the pool holds {', '.join(pool.components.names)}. Train on this pool"
        )


class RecoveryStageSettings(Settings):
    """What the recovery depends on."""

    prior: PriorSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings
    recovery: RecoverySettings


def recovery(
    *,
    pool: Path,
    estimator: Path,
    passives: Sequence[Path],
    observations: Sequence[Path],
    recovery: Path,
    settings: RecoveryStageSettings,
    origin: Origin,
) -> None:
    """Simulate fresh theta from the prior in the cohort's contexts, infer them, and score the posteriors.

    Each recording has the context, the phases and the passive baseline of one subject, and the noise of
    the experiment's observation model.

    Raises:
        ArtefactError: An input does not fit the others.
    """
    subjects = read_measured_subjects(observations, passives, settings.measurement)
    truth, raw = synthetic_recordings(subjects, settings, origin.seed)
    _judge(pool, estimator, truth, raw, recovery, settings, origin.seed)


def synthetic_recordings(
    subjects: Sequence[MeasuredSubject], settings: RecoveryStageSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and raw features with context (N, C) of recordings shared over the subjects."""
    return _shared(lambda subject, count: _recordings(subject, count, settings, seed), subjects, settings)


def _shared(
    make: Callable[[MeasuredSubject, int], tuple[FloatArray, FloatArray]],
    subjects: Sequence[MeasuredSubject],
    settings: RecoveryStageSettings | RecoveryAcquisitionStageSettings,
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and raw features with context (N, C), made subject by subject for its share."""
    counts = shares(settings.recovery.recordings, len(subjects))
    made = [make(subject, count) for subject, count in zip(subjects, counts, strict=True) if count]
    truth, raw = (np.concatenate(parts) for parts in zip(*made, strict=True))
    return truth, raw


def posterior_seed(seed: int) -> int:
    """Return the seed of the draws that recordings are inferred with."""
    return integer_seed(seed, "recovery", "posterior")


def infer(pool: Path, estimator: Path, raw: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw candidates (N, draws, 3) for recordings given as raw features with context (N, C).

    Raises:
        ArtefactError: The estimator was trained on other components than the pool's.
    """
    data, (trained, _) = read_pool(pool), load_estimator(estimator)
    check_components(data, trained, estimator)
    return draw_candidates(trained, data.standardisation.apply(raw), draws, posterior_seed(seed))


def _judge(
    pool: Path,
    estimator: Path,
    truth: FloatArray,
    raw: FloatArray,
    path: Path,
    settings: RecoveryStageSettings | RecoveryAcquisitionStageSettings,
    seed: int,
) -> None:
    """Infer N recordings, raw features with context (N, C), and write their scores against theta (N, 3)."""
    candidates = infer(pool, estimator, raw, settings.recovery.candidate_draws, seed)
    table = recovery_table(truth, candidates, settings.prior, settings.recovery)
    write_csv(path, table, float_format=None)
    LOGGER.info("%s: %d of %d recordings scored", path.stem, table["n"].max(), len(truth))
    for row in table.itertuples():
        LOGGER.info("  %s, nominal %.2f: coverage %.3f", row.parameter, row.nominal, row.coverage)


def recovery_table(
    truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> pd.DataFrame:
    """Return how often intervals of candidates (N, draws, 3) contain theta (N, 3), by parameter and level."""
    rows = score_recovery(recover(truth, candidates, prior, settings), prior, settings)
    return pd.DataFrame([asdict(row) for row in rows])


def _recordings(
    subject: MeasuredSubject, count: int, settings: RecoveryStageSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (n, 3) and raw conditioning vectors (n, C) of synthetic recordings of one subject."""
    context = subject.observation.context
    simulations = fresh_simulations(count, context, settings.prior, settings.forward_model, seed)
    clean = subject.simulated_features(
        simulations.cycle_phase, simulations.active_stiffness_kpa, settings.summary
    )
    sd = noise_sd(summary_names(settings.summary), settings.observation_model.feature_noise_sd)
    noisy = augment(clean, sd, 1, generator(seed, "recovery", "feature noise", context.subject))[:, 0]
    return simulations.theta, with_context(noisy, context)


class RecoveryAcquisitionStageSettings(Settings):
    """What this recovery depends on."""

    prior: PriorSettings
    passive_reference_prior: PriorSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    passive: PassiveSettings
    recording: RecordingSettings
    acquisition: AcquisitionSettings
    summary: SummarySettings
    recovery: RecoverySettings


def recovery_acquisition(
    *,
    pool: Path,
    estimator: Path,
    passives: Sequence[Path],
    observations: Sequence[Path],
    recovery_acquisition: Path,
    settings: RecoveryAcquisitionStageSettings,
    origin: Origin,
) -> None:
    """Record fresh theta with acquisition noise, ingest, calibrate and infer each recording, and score.

    Theta are those of the recovery under the experiment's own observation model. A recording that
    ingestion or calibration refuses is not scored; the log says how many were.

    Raises:
        ArtefactError: An input does not fit the others.
        ValueError: Every recording was refused.
    """
    subjects = read_measured_subjects(observations, passives, settings.measurement)
    tried = settings.recovery.recordings
    truth, raw = _shared(
        lambda subject, count: _acquired_recordings(subject, count, settings, origin.seed), subjects, settings
    )
    LOGGER.info("%d of %d recordings passed ingestion and calibration", len(truth), tried)
    if not len(truth):
        raise ValueError(f"all {tried} synthetic recordings were refused; see the log for the reasons")
    _judge(pool, estimator, truth, raw, recovery_acquisition, settings, origin.seed)


def _acquired_recordings(
    subject: MeasuredSubject, count: int, settings: RecoveryAcquisitionStageSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (n, 3) and raw conditioning vectors (n, C) of the recordings that passed; n <= count."""
    context = subject.observation.context
    simulations = fresh_simulations(count, context, settings.prior, settings.forward_model, seed)
    maker = _reacquisition(subject, settings)
    passed: list[int] = []
    features: list[FloatArray] = []
    for index, active in enumerate(simulations.active_stiffness_kpa):
        rng = generator(seed, "recovery", "acquisition", context.subject, index)
        try:
            features.append(maker.features(simulations.cycle_phase, active, rng))
        except (RecordingError, PassiveCalibrationError) as error:
            LOGGER.info("subject %s, synthetic recording %d refused: %s", context.subject, index, error)
        else:
            passed.append(index)
    stacked = np.array(features).reshape(len(passed), len(summary_names(settings.summary)))
    return simulations.theta[passed], with_context(stacked, context)


def _reacquisition(subject: MeasuredSubject, settings: RecoveryAcquisitionStageSettings) -> Reacquisition:
    context = subject.observation.context
    return Reacquisition(
        subject=subject,
        reference=reference_beat(context, settings.passive_reference_prior, settings.forward_model),
        acquisition=settings.acquisition,
        recording=settings.recording,
        passive=settings.passive,
        measurement=settings.measurement,
        summary=settings.summary,
    )
