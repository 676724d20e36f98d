"""What follows from choices: tables and figures of the discrepancy and of variants of an experiment."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.base import Settings
from swesbi.checks.discrepancy.cohort import generate_cohort
from swesbi.checks.discrepancy.evidence import best_pair, discrepancy_table, score_subject
from swesbi.checks.sensitivity import read_posteriors, sensitivity_table
from swesbi.checks.settings import DiscrepancyStudySettings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.progress import Progress
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator
from swesbi.show.csv import write_csv
from swesbi.show.figures.choices import draw_discrepancy, draw_sensitivity
from swesbi.show.figures.style import save_figure
from swesbi.study.stages.origin import Origin
from swesbi.virtual_cohort.settings import AcquisitionSettings

LOGGER = logging.getLogger("swesbi")


class DiscrepancyStageSettings(Settings):
    """What the choice depends on: the model, the protocol of the recordings, grid and effort.

    The grid takes the place of the model's own discrepancy, which is not used.
    """

    model: SpeedModelSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    study: DiscrepancyStudySettings


def discrepancy(
    *, table: Path, figure_pdf: Path, figure_png: Path, settings: DiscrepancyStageSettings, origin: Origin
) -> None:
    """Generate and record the cohort, score every pair on every subject, and write what they add up to.

    Raises:
        RuntimeError: A subject could not be recorded.
    """
    model, study = settings.model, settings.study
    cohort = generate_cohort(
        study.subjects,
        model.prior.theta,
        settings.acquisition,
        settings.recording,
        model.measurement.grid_points,
        origin.seed,
    )
    progress, scores = Progress("discrepancy", len(cohort), unit="subject"), []
    for index, subject in enumerate(cohort):
        rng = generator(origin.seed, "discrepancy", "bank", index)
        scores.append(score_subject(subject, model, study, rng))
        progress.step()
    phases = [len(subject.recording.phase) for subject in cohort]
    frame = discrepancy_table(study.pairs, scores, phases, study.interval)
    write_csv(table, frame)
    save_figure(draw_discrepancy(frame, study.interval), figure_pdf, figure_png)
    best = best_pair(frame)
    LOGGER.info(
        "highest total log evidence over %d generated subjects: speed_fraction %g, timing_cycle %g",
        len(cohort),
        best.speed_fraction,
        best.timing_cycle,
    )


class SensitivityStageSettings(Settings):
    """What the table and the figure call things; ``labels`` by variant, in the order shown."""

    cohort_title: str
    interval: float
    labels: dict[str, str]


def sensitivity(
    *,
    variants: Sequence[Path],
    table: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: SensitivityStageSettings,
    origin: Origin,
) -> None:
    """Write how far medians and intervals move under each variant; each file is named by its variant."""
    files = {path.stem: path for path in variants}
    posteriors = {name: read_posteriors(files[name]) for name in settings.labels}
    frame = sensitivity_table(posteriors, settings.labels, settings.interval)
    write_csv(table, frame)
    save_figure(draw_sensitivity(frame, settings.cohort_title), figure_pdf, figure_png)
