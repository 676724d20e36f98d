"""Stage: recovery of known parameters from recordings with acquisition noise, passed through the pipeline."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import simulate
from swesbi.inference.pool import with_context
from swesbi.inference.reacquisition import Reacquisition
from swesbi.inference.recovery import fresh_simulations, shares
from swesbi.inference.settings import RecoverySettings
from swesbi.inference.subjects import MeasuredSubject, read_measured_subjects
from swesbi.observation.passive import PassiveCalibrationError
from swesbi.observation.settings import MeasurementSettings, PassiveSettings, SummarySettings, summary_names
from swesbi.prior import PriorSettings, log_centre
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator
from swesbi.settings import Settings
from swesbi.stages.origin import Origin
from swesbi.stages.recovery import infer, write_scores
from swesbi.virtual_cohort.settings import AcquisitionSettings

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]


class RecoveryAcquisitionStageSettings(Settings):
    """What this recovery depends on, beside its input files."""

    prior: PriorSettings
    passive_reference_prior: PriorSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    passive: PassiveSettings
    recording: RecordingSettings
    acquisition: AcquisitionSettings
    summary: SummarySettings
    recovery: RecoverySettings


def run(
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
    subjects = read_measured_subjects(observations, passives)
    counts = shares(settings.recovery.recordings, len(subjects))
    made = [_recordings(s, n, settings, origin.seed) for s, n in zip(subjects, counts, strict=True) if n]
    truth, raw = (np.concatenate(parts) for parts in zip(*made, strict=True))
    LOGGER.info("%d of %d recordings passed ingestion and calibration", len(truth), sum(counts))
    if not len(truth):
        raise ValueError(f"all {sum(counts)} synthetic recordings were refused; see the log for the reasons")
    posteriors = infer(pool, estimator, raw, settings.recovery.candidate_draws, origin.seed)
    write_scores(recovery_acquisition, truth, posteriors, settings.prior, settings.recovery)


def _recordings(
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
    centre = log_centre(settings.passive_reference_prior)
    reference = simulate(centre[None, :], subject.observation.context, settings.forward_model)
    return Reacquisition(
        subject=subject,
        reference=reference,
        acquisition=settings.acquisition,
        recording=settings.recording,
        passive=settings.passive,
        measurement=settings.measurement,
        summary=settings.summary,
    )
