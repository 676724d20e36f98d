"""The choice of the discrepancy: pairs (delta, tau) scored on generated subjects with known model error."""

from __future__ import annotations

from typing import NamedTuple

from studies.discrepancy.evidence import discrepancy_table, score_subject
from studies.discrepancy.figure import draw_discrepancy
from studies.discrepancy.settings import DiscrepancyStudySettings
from swesbi.artefacts.csv import PlainTable
from swesbi.base.progress import Progress
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.report.figures.style import Drawing
from swesbi.seeds import generator
from swesbi.virtual.generated import generate_cohort


class Choice(NamedTuple):
    """What the scores of all pairs add up to, a row a pair, and its figure."""

    table: PlainTable
    figure: Drawing


def discrepancy(
    *,
    model: SpeedModelSettings,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    study: DiscrepancyStudySettings,
    seed: int,
) -> Choice:
    """Generate and record the cohort, and score every pair on every subject.

    Args:
        model: The grid takes the place of its discrepancy.

    Raises:
        RuntimeError: A subject could not be recorded.
    """
    points = model.measurement.grid_points
    cohort = generate_cohort(study.subjects, model.prior.theta, acquisition, recording, points, seed)
    progress, scores = Progress("discrepancy", len(cohort), unit="subject"), []
    for index, subject in enumerate(cohort):
        scores.append(score_subject(subject, model, study, generator(seed, "discrepancy", "bank", index)))
        progress.step()
    phases = [len(subject.recording.phase) for subject in cohort]
    table = discrepancy_table(study.pairs, scores, phases, study.interval)
    return Choice(table, draw_discrepancy(table, study.interval))
