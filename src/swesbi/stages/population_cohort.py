"""Stage: every subject of a cohort as a network over a population answers it: one table, one figure."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.truth import read_truth
from swesbi.population.cohort import OUTCOMES, cohort_table, read_answer
from swesbi.recording import ContextRow
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.show.figures.cohort import Overview, draw_cohort
from swesbi.show.figures.style import save_figure
from swesbi.speed_model.joint_prior import JointPriorSettings
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place, pick

LOGGER = logging.getLogger("swesbi")


class PopulationCohortStageSettings(Settings):
    """Whom the cohort holds, who of them is refused and why, and what the figure says of them.

    Attributes:
        cohort_title: What the subjects are called.
        experiment: Name of the experiment.
        contexts: All subjects, in the cohort's order.
        refused: Reasons, by subject.
        prior: The joint prior, drawn for scale.
        interval: Mass of the credible intervals.
    """

    cohort_title: str
    experiment: str
    contexts: tuple[ContextRow, ...]
    refused: dict[str, str]
    prior: JointPriorSettings
    interval: float


def run(
    *,
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    truth: Sequence[Path],
    cohort: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: PopulationCohortStageSettings,
    origin: Origin,
) -> None:
    """Write the table and draw it; summaries are read one subject after the other.

    Args:
        posteriors: Of every subject that is answered.
        supports: Likewise.
        truth: True parameters of a generated cohort, or none.
        cohort: Output, the table.
        figure_pdf: Output.
        figure_png: Output.
        settings: The cohort, and what it is called.
        origin: Whose work this is.

    Raises:
        ArtefactError: A file is missing or not what its name says.
    """
    judged = by_place(supports)
    answers = {
        place.subject: read_answer(path, pick(judged, place, "verdict"))
        for place, path in by_place(posteriors).items()
    }
    contexts = [row.to_context() for row in settings.contexts]
    table = cohort_table(contexts, answers, settings.refused)
    write_csv(cohort, table)
    overview = Overview(table, read_truth(truth), settings.prior, settings.interval)
    save_figure(draw_cohort(overview, settings.cohort_title, settings.experiment), figure_pdf, figure_png)
    counts = table["status"].value_counts()
    LOGGER.info("%s", ", ".join(f"{counts[name]} {name}" for name in OUTCOMES if name in counts))
