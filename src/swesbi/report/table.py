"""A table is a dataframe and the columns that are shown of it; HTML and LaTeX are its renderings.

HTML is set by the macro of ``page``, LaTeX by :mod:`swesbi.report.latex`; CSV is the dataframe alone.
Symbols stand as k_0, k_ATP, k_SR and D_T; each rendering sets them in its own way.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import pandas as pd

from swesbi.report.numbers import MISSING, formatted, span

MARK: Final = "mark"
"""The column of the dataframe that says how a row is set: one of the next three, or nothing."""
MUTED, DOUBTFUL, SUMMARY = "muted", "doubtful", "summary"


@dataclass(frozen=True)
class Link:
    """A link to a file, relative to the page."""

    text: str
    href: str


@dataclass(frozen=True)
class Strong:
    """Text that stands out: a flagged test, a failed check."""

    text: str


Cell = str | Strong | tuple[Link, ...]


def as_words(value: object) -> Cell:
    """Return a cell of words as it is, a dash where there is none."""
    if isinstance(value, (Strong, tuple)):
        return value
    return MISSING if pd.isna(value) else str(value)  # type: ignore[call-overload]


@dataclass(frozen=True)
class Column:
    """One column: what it takes of the dataframe, its heading, its unit, and how a cell is set.

    Of several sources the values go into one cell. ``shown`` is a format of
    :func:`swesbi.report.numbers.formatted` or a function of the values. By a format, two values are an
    interval, and three a value with its interval. What is numeric stands at the right.
    """

    source: str | tuple[str, ...]
    head: str
    unit: str = ""
    shown: str | Callable[..., Cell] = as_words
    numeric: bool = True

    @property
    def heading(self) -> str:
        """Name and unit in a line."""
        if not self.unit:
            return self.head
        return f"{self.head}, {self.unit}" if "(" in self.unit else f"{self.head} ({self.unit})"

    def cell(self, row: Mapping[Hashable, Any]) -> Cell:
        """Return the cell of a row of the dataframe."""
        names = (self.source,) if isinstance(self.source, str) else self.source
        values = [row[name] for name in names]
        if callable(self.shown):
            return self.shown(*values)
        first, *ends = (formatted(value, self.shown) for value in values)
        if len(ends) < 2:
            return span(first, *ends) if ends else first
        return first if first == MISSING else f"{first} ({span(*ends)})"


def words(
    source: str | tuple[str, ...], head: str, shown: Callable[..., Cell] | Mapping[str, str] = as_words
) -> Column:
    """Return a column of words; a mapping gives names, what it lacks stands as it is."""
    if isinstance(shown, Mapping):
        return words(source, head, lambda name: shown[name] if name in shown else as_words(name))
    return Column(source, head, "", shown, numeric=False)


class Row(NamedTuple):
    """The cells of a row, the first of which is its heading, and how it is set."""

    cells: tuple[Cell, ...]
    mark: str


@dataclass(frozen=True)
class Table:
    """A captioned table, its note below; a column ``MARK`` of its frame says how each row is set.

    Without columns, every one of the frame is shown, as words.
    """

    caption: str
    frame: pd.DataFrame
    columns: Sequence[Column] = ()
    note: str = ""

    def __post_init__(self) -> None:
        if not self.columns:
            object.__setattr__(self, "columns", [words(str(name), str(name)) for name in self.frame])

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Its rows as they are shown."""
        return tuple(
            Row(tuple(column.cell(row) for column in self.columns), str(row.get(MARK, "")))
            for row in self.frame.to_dict("records")
        )
