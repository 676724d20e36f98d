"""The part of the page on other people's hearts: the small exam of the study, and the exam that was sat."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.show.numbers import as_percent
from swesbi.show.page.files import Figure, figure
from swesbi.show.table import Table
from swesbi.show.tables.exam import exam_table, noise_of, read_exam
from swesbi.show.tables.exam_outcomes import in_brief

SMALL: Final = "The small exam of this study"
SAT: Final = "The exam as the shipped study sat it"


@dataclass(frozen=True)
class SmallExam:
    """The small exam of the study whose results the page shows: a few hearts of development."""

    table: Table
    figure: Figure


@dataclass(frozen=True)
class SatExam:
    """The exam that the shipped study sat: what came out in sentences, and all of it."""

    brief: tuple[str, ...]
    table: Table


@dataclass(frozen=True)
class ExamSection:
    """What the templates show of the exam.

    Attributes:
        interval: Mass of the credible intervals of the small exam, as text ("90 %").
        experiment: The experiment whose network answered the small exam.
        small: The small exam; None where the study does not run that experiment.
        asked: Whether the page is to show the exam that was sat.
        sat: The exam that was sat; None where it is not asked for, or no table of it is stored.
    """

    interval: str
    experiment: str
    small: SmallExam | None
    asked: bool
    sat: SatExam | None


def make_exam_section(
    experiment: str, interval: float, small: SmallExam | None, asked: bool, sat: SatExam | None
) -> ExamSection | None:
    """Return the section; None where there is nothing to say."""
    if small is None and not asked:
        return None
    return ExamSection(as_percent(interval), experiment, small, asked, sat)


def small_exam(table: pd.DataFrame, png: Path, page: Path) -> SmallExam:
    """Return what the page shows of the small exam.

    Args:
        table: ``small_exam.csv``.
        png: Its figure, the PDF beside it.
        page: The page.

    Raises:
        ArtefactError: The figure is no PNG.
    """
    what = f"Coverage by generator in the small exam of development, at {noise_of(table)}"
    caption = f"{what}, over all answered hearts and over the supported ones."
    return SmallExam(exam_table(table, SMALL), figure(png, page, what, caption, png.with_suffix(".pdf")))


def sat_exam(path: Path) -> SatExam:
    """Return what the page shows of the exam that was sat.

    Args:
        path: Its stored table.

    Raises:
        ArtefactError: It is no such table.
    """
    table = read_exam(path)
    return SatExam(in_brief(table), exam_table(table, SAT))
