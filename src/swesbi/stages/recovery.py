"""Stage: recovery of known parameters under the experiment's own observation model."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import atomic_path
from swesbi.forward_model import ForwardModelSettings
from swesbi.inference.dataset import read_pool
from swesbi.inference.estimator import load_estimator
from swesbi.inference.observation_model import augment, noise_sd
from swesbi.inference.recovery import RecoveryRow, recover, score_recovery, shares
from swesbi.inference.sampling import draw_candidates
from swesbi.inference.settings import ObservationModelSettings, RecoverySettings
from swesbi.inference.subjects import MeasuredSubject, read_measured_subjects
from swesbi.observation import MeasurementSettings, SummarySettings, summary_names
from swesbi.seeds import generator, integer_seed
from swesbi.settings import Settings
from swesbi.simulations.draw import draw_simulations
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
    data, (trained, _) = read_pool(pool), load_estimator(estimator)
    check_components(data, trained, estimator)
    subjects = read_measured_subjects(observations, passives)
    counts = shares(settings.recovery.recordings, len(subjects))
    made = [_recordings(s, n, settings, origin.seed) for s, n in zip(subjects, counts, strict=True) if n]
    truth, raw = (np.concatenate(parts) for parts in zip(*made, strict=True))
    seed = integer_seed(origin.seed, "recovery", "posterior")
    z = data.standardisation.apply(raw)
    candidates = draw_candidates(trained, z, settings.recovery.candidate_draws, seed)
    recovered = recover(truth, candidates, settings.prior, settings.recovery)
    LOGGER.info("recovery: %d of %d recordings scored", len(recovered.truth), len(truth))
    write_rows(recovery, score_recovery(recovered, settings.prior, settings.recovery))


def write_rows(path: Path, rows: Sequence[RecoveryRow]) -> None:
    """Write recovery rows as CSV."""
    with atomic_path(path) as temporary:
        pd.DataFrame([asdict(row) for row in rows]).to_csv(temporary, index=False, lineterminator="\n")


def _recordings(
    subject: MeasuredSubject, count: int, settings: RecoveryStageSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (n, 3) and raw conditioning vectors (n, C) of synthetic recordings of one subject."""
    context = subject.observation.context
    simulations = draw_simulations(
        range(count), context, settings.prior, settings.forward_model, integer_seed(seed, "recovery")
    )
    clean = subject.simulated_features(
        simulations.cycle_phase, simulations.active_stiffness_kpa, settings.measurement, settings.summary
    )
    sd = noise_sd(summary_names(settings.summary), settings.observation_model.feature_noise_sd)
    noisy = augment(clean, sd, 1, generator(seed, "recovery", "feature noise", context.subject))[:, 0]
    return simulations.theta, np.concatenate([noisy, np.tile(context.as_array(), (count, 1))], axis=1)
