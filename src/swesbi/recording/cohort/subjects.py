"""``subjects.csv``, one row a subject: the heart, what else was measured, and which visit of whom it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from swesbi.context import CONTEXT, CONTEXT_BOUNDS, Context
from swesbi.recording.cohort.clinical import CLINICAL_NAMES, ClinicalRow, clinical_rows
from swesbi.recording.cohort.visits import VISIT_NAMES, Visit, visit_rows
from swesbi.recording.problems import Problem, listed, raise_any
from swesbi.recording.settings import ContextRow, is_subject
from swesbi.recording.tables.csv_text import read_csv
from swesbi.recording.tables.table import Table, stood_before
from swesbi.seeds import spawn_key

CONTEXT_COLUMNS: Final = tuple(ContextRow.model_fields)
REMEDIES: Final = {
    "subject": "use letters, digits, '-' and '_', a letter or digit first, at most 64 of them",
    **{variable.column: variable.remedy for variable in CONTEXT},
}


@dataclass(frozen=True)
class SubjectTable:
    """What ``subjects.csv`` says, as far as it can be used.

    ``names`` are the subjects with a usable name, in the file's order, those with other problems included;
    ``visits`` are theirs. ``rows`` and ``clinical`` have those without a problem. ``lines`` has by row of the
    file what stands there for the subject's name; ``left_out`` says what is not used, a sentence each.
    """

    names: tuple[str, ...]
    rows: Mapping[str, ContextRow]
    clinical: Mapping[str, ClinicalRow]
    visits: Mapping[str, Visit]
    problems: tuple[Problem, ...]
    lines: Mapping[int, str] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    @property
    def refused(self) -> dict[str, str]:
        """The subjects whose row cannot be used, and why; what is wrong with no one row is everyone's."""
        own: dict[str, list[Problem]] = {}
        for problem in self.problems:
            subject = self.lines.get(problem.row or 0)
            for name in dict.fromkeys(self.lines.values()) if subject is None else (subject,):
                own.setdefault(name, []).append(problem)
        return {name: listed(problems) for name, problems in own.items()}


def examine_subjects(path: Path) -> SubjectTable:
    """Read ``subjects.csv`` as far as it goes; further columns are ignored."""
    texts = ("subject", "sex", *VISIT_NAMES)
    table = read_csv(path).using(CONTEXT_COLUMNS, (*CLINICAL_NAMES, *VISIT_NAMES), texts)
    _check_names(table)
    numbers = {
        name: table.number(name, low, high, REMEDIES[name]) for name, (low, high) in CONTEXT_BOUNDS.items()
    }
    rows = [_context_row(table, index, numbers) for index in range(len(table.rows))]
    clinical = clinical_rows(table, numbers["hr_bpm"])
    visits = visit_rows(table, numbers["age_years"])
    good = [(row, own) for row, own in zip(rows, clinical, strict=True) if row and own]
    names = table.cells["subject"].tolist()
    return SubjectTable(
        names=tuple(dict.fromkeys(filter(is_subject, names))),
        rows={row.subject: row for row, _ in good},
        clinical={row.subject: own for row, own in good},
        visits={name: visit for name, visit in zip(names, visits, strict=True) if is_subject(name)},
        problems=tuple(table.problems),
        lines=dict(zip(table.rows.tolist(), names, strict=True)),
        left_out=(*table.left_out, *([f"not used: {', '.join(table.ignored)}"] if table.ignored else [])),
    )


def read_subject_table(path: Path) -> SubjectTable:
    """Read ``subjects.csv``: one row a subject, in the file's order; further columns are ignored."""
    table = examine_subjects(path)
    raise_any(table.problems)
    return table


def read_subjects(path: Path) -> tuple[Context, ...]:
    """Read ``subjects.csv`` as contexts, in the file's order."""
    return tuple(row.to_context() for row in read_subject_table(path).rows.values())


def _check_names(table: Table) -> None:
    """Subjects are named once, and not alike: folders of results may ignore upper and lower case."""
    table.unique(["subject"])
    table.spelled_once("subject")
    names = table.cells["subject"].tolist()
    words = [str(spawn_key(name)) for name in names]
    alike = stood_before([words]) & ~stood_before([names])
    table.flag("subject", alike, "names the same random numbers as an earlier one", "rename one")


def _context_row(table: Table, index: int, numbers: Mapping[str, Any]) -> ContextRow | None:
    known = {
        name: float(numbers[name][index])
        for name, (low, high) in CONTEXT_BOUNDS.items()
        if low <= numbers[name][index] <= high
    }
    texts = {name: table.cells[name][index] for name in CONTEXT_COLUMNS if name not in numbers}
    try:
        return ContextRow.from_plain(texts | known)
    except ValidationError as error:
        for details in error.errors():
            if details["type"] != "missing":  # said already: the cell is not a number, or outside its bounds
                message = details["msg"].removeprefix("Value error, ")
                # of several columns the one that is named first is blamed
                named = sorted(filter(message.__contains__, CONTEXT_COLUMNS), key=message.find)
                column = str((*details["loc"], *named)[0])
                table.note(index, column, f"is refused: {message}", REMEDIES[column])
        return None
