"""The choice of the discrepancy: pairs (delta, tau) scored on generated subjects with known model error."""

from __future__ import annotations

import logging
from pathlib import Path

import pandas as pd

from studies.discrepancy.evidence import discrepancy_table, score_subject
from studies.discrepancy.figure import draw_discrepancy
from studies.discrepancy.settings import DiscrepancyStudySettings
from swesbi.artefacts import Origin
from swesbi.artefacts.csv import write_csv
from swesbi.base.progress import Progress
from swesbi.base.settings import Settings
from swesbi.measurement import likelihood
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.report.figures.style import save_figure
from swesbi.seeds import generator
from swesbi.virtual.generated import generate_cohort

LOGGER = logging.getLogger("swesbi")


class DiscrepancyStageSettings(Settings):
    """What the choice depends on: the model, the protocol of the recordings, grid and effort.

    The grid takes the place of the model's own discrepancy, which is not used.
    """

    model: likelihood.SpeedModelSettings
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


def best_pair(table: pd.DataFrame) -> DiscrepancySettings:
    """Return the pair with the highest total log evidence."""
    row = table.iloc[int(table["log_evidence"].argmax())]
    return DiscrepancySettings(
        speed_fraction=float(row["speed_fraction"]), timing_cycle=float(row["timing_cycle"])
    )
