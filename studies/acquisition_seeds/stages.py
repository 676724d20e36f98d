"""The study over acquisition seeds: a row for each recording, and medians over the seeds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from studies.acquisition_seeds.judge import AcquisitionSeedsStageSettings, judged_recordings
from studies.acquisition_seeds.table import medians_table
from swesbi.artefacts import Origin
from swesbi.artefacts.csv import write_csv
from swesbi.measurement.likelihood import read_measured_subjects
from swesbi.networks.paper.estimator import load_estimator
from swesbi.networks.paper.pool import read_pool
from swesbi.study.stages.inference import check_components


def acquisition_seeds(
    *,
    pool: Path,
    estimator: Path,
    observations: Sequence[Path],
    passives: Sequence[Path],
    shards: Sequence[Path],
    recordings: Path,
    medians: Path,
    settings: AcquisitionSeedsStageSettings,
    origin: Origin,
) -> None:
    """Record every volunteer under every seed, ingest, calibrate, infer and score; write a row for each.

    The network is that of the study and is not trained again. Under the shipped seed the outcome is the
    study's own.

    Raises:
        ArtefactError: A subject is no virtual volunteer, or an input does not fit the others.
    """
    data, (trained, _) = read_pool(pool), load_estimator(estimator)
    check_components(data, trained, estimator)
    subjects = read_measured_subjects(observations, passives, settings.measurement)
    table = judged_recordings(data, trained, subjects, shards, settings, origin.seed)
    write_csv(recordings, table)
    write_csv(medians, medians_table(table), float_format="%.4g")
