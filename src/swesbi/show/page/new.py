"""Answers to subjects outside the study, as far as there are any."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from swesbi.show.numbers import MISSING, PARAMETER_UNITS, PARAMETERS, estimate
from swesbi.show.page.files import relative
from swesbi.show.table import Cell, Column, Link, Row, Table, words
from swesbi.verdict.answers import STRAINED, status
from swesbi.verdict.support import read_support

ANSWERS: Final = "new/*/answers.csv"
VERDICTS: Final = "*/new/*/*/support.json"


def new_subjects(page: Path) -> Table | None:
    """Return a row for each answer to a subject outside the study; None where there are none.

    They are looked for beside the page, since they belong to no run of the study: whoever answered a subject
    after it makes the page anew to see it listed.

    Raises:
        ArtefactError: A verdict is damaged.
    """
    verdicts, tables = (sorted(page.parent.glob(pattern)) for pattern in (VERDICTS, ANSWERS))
    if not verdicts and not tables:
        return None
    columns = (
        *words("Subject", "Cohort", "By", "Verdict"),
        *(Column(symbol, PARAMETER_UNITS[name]) for name, symbol in PARAMETERS.items()),
        *words("Files"),
    )
    rows = [*(_verdict(path, page) for path in verdicts), *(_table(path, page) for path in tables)]
    return Table("Answers to subjects outside the study.", columns, tuple(rows))


def _verdict(path: Path, page: Path) -> Row:
    support = read_support(path)
    experiment, _, cohort, subject, _ = path.relative_to(page.parent).parts
    verdict = status(support)
    found = sorted(path.parent.glob("*.png"))
    links = tuple(Link(each.name, relative(each, page)) for each in (path, *found))
    cells: tuple[Cell, ...] = (
        subject,
        cohort,
        experiment,
        verdict,
        *_values(support.answer),
        links,
    )
    return Row(cells, muted=not support.supported, strained=verdict == STRAINED)


def _values(answer: Mapping[str, Mapping[str, float | str]]) -> Iterator[str]:
    for name in PARAMETERS:
        if name not in answer:
            yield MISSING
            continue
        median, interval = estimate(*(float(answer[name][key]) for key in ("median", "low", "high")))
        yield f"{median} ({interval})"


def _table(path: Path, page: Path) -> Row:
    empty = (MISSING,) * (2 + len(PARAMETERS))
    return Row(("all", path.parent.name, *empty, (Link(path.name, relative(path, page)),)), summary=True)
