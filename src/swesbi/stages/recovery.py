"""Stage: recovery of known parameters under the experiment's own observation model."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.forward_model import ForwardModelSettings
from swesbi.inference.dataset import read_pool
from swesbi.inference.estimator import load_estimator
from swesbi.inference.observation_model import augment, noise_sd
from swesbi.inference.pool import with_context
from swesbi.inference.recovery import fresh_simulations, recover, score_recovery, shares
from swesbi.inference.sampling import draw_candidates
from swesbi.inference.settings import ObservationModelSettings, RecoverySettings
from swesbi.inference.subjects import MeasuredSubject, read_measured_subjects
from swesbi.observation import MeasurementSettings, SummarySettings, summary_names
from swesbi.seeds import generator, integer_seed
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.simulations.prior import PriorSettings
from swesbi.stages.origin import Origin
from swesbi.stages.posterior import check_components

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]


class RecoveryStageSettings(Settings):
    """What the recovery depends on, beside its input files."""

    prior: PriorSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings
    recovery: RecoverySettings


def run(
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
    subjects = read_measured_subjects(observations, passives)
    truth, raw = synthetic_recordings(subjects, settings, origin.seed)
    posteriors = infer(pool, estimator, raw, settings.recovery.candidate_draws, origin.seed)
    write_scores(recovery, truth, posteriors, settings.prior, settings.recovery)


def synthetic_recordings(
    subjects: Sequence[MeasuredSubject], settings: RecoveryStageSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and raw features with context (N, C) of recordings shared over the subjects."""
    counts = shares(settings.recovery.recordings, len(subjects))
    made = [_recordings(s, n, settings, seed) for s, n in zip(subjects, counts, strict=True) if n]
    truth, raw = (np.concatenate(parts) for parts in zip(*made, strict=True))
    return truth, raw


def infer(pool: Path, estimator: Path, raw: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw candidates (N, draws, 3) for recordings given as raw features and context, shape (N, C).

    Raises:
        ArtefactError: The estimator was trained on other components than the pool's.
    """
    data, (trained, _) = read_pool(pool), load_estimator(estimator)
    check_components(data, trained, estimator)
    z = data.standardisation.apply(raw)
    return draw_candidates(trained, z, draws, posterior_seed(seed))


def posterior_seed(seed: int) -> int:
    """Return the seed of the draws that recordings are inferred with."""
    return integer_seed(seed, "recovery", "posterior")


def write_scores(
    path: Path, truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> None:
    """Score the posteriors of N recordings against their truth (N, 3) and write one row a score."""
    recovered = recover(truth, candidates, prior, settings)
    rows = score_recovery(recovered, prior, settings)
    write_csv(path, pd.DataFrame([asdict(row) for row in rows]), float_format=None)
    LOGGER.info("%s: %d of %d recordings scored", path.stem, len(recovered.truth), len(truth))
    for row in rows:
        LOGGER.info("  %s, nominal %.2f: coverage %.3f", row.parameter, row.nominal, row.coverage)


def _recordings(
    subject: MeasuredSubject, count: int, settings: RecoveryStageSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (n, 3) and raw conditioning vectors (n, C) of synthetic recordings of one subject."""
    context = subject.observation.context
    simulations = fresh_simulations(count, context, settings.prior, settings.forward_model, seed)
    clean = subject.simulated_features(
        simulations.cycle_phase, simulations.active_stiffness_kpa, settings.measurement, settings.summary
    )
    sd = noise_sd(summary_names(settings.summary), settings.observation_model.feature_noise_sd)
    noisy = augment(clean, sd, 1, generator(seed, "recovery", "feature noise", context.subject))[:, 0]
    return simulations.theta, with_context(noisy, context)
