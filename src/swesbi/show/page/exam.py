"""The part of the page on other people's hearts: the exam that the shipped study sat."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.show.table import Table
from swesbi.show.tables.exam import exam_table, read_exam
from swesbi.show.tables.exam_outcomes import in_brief

SAT: Final = "The exam as the shipped study sat it"


@dataclass(frozen=True)
class SatExam:
    """The exam that the shipped study sat: what came out in sentences, and all of it."""

    brief: tuple[str, ...]
    table: Table


def sat_exam(path: Path) -> SatExam:
    """Return what the page shows of the exam that was sat.

    Args:
        path: Its stored table.

    Raises:
        ArtefactError: It is no such table.
    """
    table = read_exam(path)
    return SatExam(in_brief(table), exam_table(table, SAT))
