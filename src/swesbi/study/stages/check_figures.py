"""Figures of what the answers rest on: noise, misspecification tests, calibration, a population."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import ArtefactError, Origin, load
from swesbi.artefacts.csv import checked, read_csv, write_csv
from swesbi.base.settings import Settings
from swesbi.checks.calibration.alarms import AlarmRow
from swesbi.checks.calibration.dataset import KIND, diagnostics_of, ranked_of
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.checks.calibration.table import COLUMNS, LOCAL
from swesbi.checks.recovery import read_truth
from swesbi.prior import JointPriorSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.settings import ContextRow
from swesbi.report.figures.calibration import CalibrationCase, draw_calibration
from swesbi.report.figures.cohort import Overview, draw_cohort
from swesbi.report.figures.misspecification import draw_misspecification
from swesbi.report.figures.population import draw_strata, read_strata
from swesbi.report.figures.recording import draw_noise
from swesbi.report.figures.style import save_figure
from swesbi.study.stages.origin import by_key
from swesbi.verdict.answers import OUTCOMES, cohort_table, read_answer
from swesbi.verdict.verdict import read_verdict

LOGGER = logging.getLogger("swesbi")


class NoiseFigureSettings(Settings):
    """What the figure calls the subjects."""

    cohort_title: str


def noise_figure(
    *, noise: Path, figure_pdf: Path, figure_png: Path, settings: NoiseFigureSettings, origin: Origin
) -> None:
    """Draw both variance components, of each recording and of the cohort."""
    save_figure(draw_noise(CohortNoise.read(noise), settings.cohort_title), figure_pdf, figure_png)


class MisspecificationFigureStageSettings(Settings):
    """What the figure calls the subjects, and the level that the alarms are to keep."""

    cohort_title: str
    strained_level: float


def misspecification_figure(
    *,
    table: Path,
    verdicts: Sequence[Path],
    figure_pdf: Path,
    figure_png: Path,
    settings: MisspecificationFigureStageSettings,
    origin: Origin,
) -> None:
    """Draw every subject's p-values and verdict, and below them how often the tests raise an alarm.

    Raises:
        ArtefactError: The table lacks a column or a verdict cannot be read.
    """
    judged = {key.subject: read_verdict(path) for key, path in by_key(verdicts).items()}
    figure = draw_misspecification(judged, _read_rows(table), settings.strained_level, settings.cohort_title)
    save_figure(figure, figure_pdf, figure_png)


def _read_rows(path: Path) -> list[AlarmRow]:
    try:
        table = read_csv(path, ("recordings", "alarm"))
        return [
            AlarmRow(**{str(name): value for name, value in row.items()}) for row in table.to_dict("records")
        ]
    except (OSError, ValueError, TypeError) as error:
        raise ArtefactError(f"{path}: cannot be read as alarms.csv ({error})") from error


class CalibrationFigureSettings(Settings):
    """What is required of the posteriors, and what the figure calls the subjects and the experiment."""

    judgement: JudgementSettings
    max_k_hat: float
    experiment: str
    cohort_title: str


def calibration_figure(
    *,
    calibration: Path,
    table: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: CalibrationFigureSettings,
    origin: Origin,
) -> None:
    """Draw an experiment's calibration: ranks, coverage, weights and local calibration.

    Raises:
        ArtefactError: A file is no such result.
    """
    groups = {name: load(calibration, KIND, name)[0] for name in ("own", "acquired", LOCAL)}
    checks = checked(read_csv(table), table, COLUMNS)
    case = CalibrationCase(
        ranked={name: ranked_of(group) for name, group in groups.items()},
        diagnostics=diagnostics_of(groups["own"]),
        table=checks,
        settings=settings.judgement,
        max_k_hat=settings.max_k_hat,
    )
    save_figure(draw_calibration(case, settings.cohort_title, settings.experiment), figure_pdf, figure_png)


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


def population_cohort(
    *,
    verdicts: Sequence[Path],
    truth: Sequence[Path],
    cohort: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: PopulationCohortStageSettings,
    origin: Origin,
) -> None:
    """Write and draw every subject of a cohort as a population's network answers it.

    Summaries are read one subject after the other.

    Args:
        verdicts: Of every subject that is answered.
        truth: True parameters of a generated cohort, or none.
        cohort: Output, the table.
        figure_pdf: Output.
        figure_png: Output.

    Raises:
        ArtefactError: A file is missing or not what its name says.
    """
    answers = {key.subject: read_answer(path) for key, path in by_key(verdicts).items()}
    contexts = [row.to_context() for row in settings.contexts]
    table = cohort_table(contexts, answers, settings.refused)
    write_csv(cohort, table)
    overview = Overview(table, read_truth(truth), settings.prior, settings.interval)
    save_figure(draw_cohort(overview, settings.cohort_title, settings.experiment), figure_pdf, figure_png)
    counts = table["status"].value_counts()
    LOGGER.info("%s", ", ".join(f"{counts[name]} {name}" for name in OUTCOMES if name in counts))


class StrataFigureSettings(Settings):
    """What the figure shows of the table, and whose it is.

    Attributes:
        experiment: Name of the experiment.
        interval: Nominal level of the credible intervals shown.
    """

    experiment: str
    interval: float


def strata_figure(
    *, strata: Path, figure_pdf: Path, figure_png: Path, settings: StrataFigureSettings, origin: Origin
) -> None:
    """Draw coverage and efficiency by stratum of an experiment over a population.

    Raises:
        ArtefactError: The table is not one of strata.
    """
    drawn = draw_strata(read_strata(strata), settings.interval, settings.experiment)
    save_figure(drawn, figure_pdf, figure_png)
