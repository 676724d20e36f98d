"""What the answers to the hearts of the exam come to: tables and a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import Field

from swesbi.artefacts import load
from swesbi.base import Settings
from swesbi.exam.score import KIND, HeartAnswer, read_answers
from swesbi.exam.settings import NoiseLevel, ScoreSettings
from swesbi.exam.table import exam_table as table_of
from swesbi.exam.table import samplers_table
from swesbi.show.csv import write_csv
from swesbi.show.figures.exam import draw_exam
from swesbi.show.figures.style import save_figure
from swesbi.study.stages.exam import ExamAnswersStageSettings
from swesbi.study.stages.origin import Origin


class ExamTableStageSettings(Settings):
    """What the tables and the figure depend on."""

    score: ScoreSettings
    interval: float = Field(gt=0.0, lt=1.0, description="mass of the credible intervals")
    pressures: bool = Field(description="whether the answers are those with cuff pressures")


def exam_table(
    *,
    answers: Sequence[Path],
    table: Path,
    samplers: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: ExamTableStageSettings,
    origin: Origin,
) -> None:
    """Write what the answers of all generators come to: coverage by quantity, samplers, a figure.

    Args:
        answers: Of each generator, at one level of noise.
        table: Output, one row a generator and quantity.
        samplers: Output, one row a generator.
        figure_pdf: Output, coverage.
        figure_png: Output, the same.

    Raises:
        ArtefactError: A file holds no answers.
        ValueError: The files are of several levels of noise.
    """
    by_letter, titles, noise = _by_letter(answers)
    frame = table_of(by_letter, titles, noise, settings.score)
    write_csv(table, frame)
    write_csv(samplers, samplers_table(by_letter, titles, noise))
    save_figure(draw_exam(frame, settings.interval, settings.pressures), figure_pdf, figure_png)


def _by_letter(
    answers: Sequence[Path],
) -> tuple[Mapping[str, list[HeartAnswer]], Mapping[str, str], NoiseLevel]:
    """Return the answers and the title of each generator, by letter in order, and their level of noise."""
    of_path = {path: _settings_of(path) for path in answers}
    levels: list[NoiseLevel] = sorted({settings.noise for settings in of_path.values()})
    if len(levels) != 1:
        raise ValueError(
            f"a table needs answers at one level of noise, found {len(levels)} ({', '.join(levels)}) among "
            f"{', '.join(map(str, answers))}; make a table of each"
        )
    ordered = sorted(of_path.items(), key=lambda item: item[1].generator)
    found = {settings.generator: read_answers(path) for path, settings in ordered}
    return found, {settings.generator: settings.source.title for _, settings in ordered}, levels[0]


def _settings_of(path: Path) -> ExamAnswersStageSettings:
    return ExamAnswersStageSettings.from_plain(dict(load(path, KIND)[1].settings))
