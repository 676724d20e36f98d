"""A table as page and documentation show it: Markdown is set here, HTML by the macro of ``page``.

Every cell is text as a reader can use it, formatted by :mod:`swesbi.report.numbers`: how many digits a number
deserves often depends on its row (an interval's width, a parameter's size), so a format belongs to the cell.
Symbols stand as k_0, k_ATP, k_SR and D_T; each rendering sets them in its own way.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from swesbi.report.numbers import MISSING

BAR: Final = "\\|"


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


@dataclass(frozen=True)
class Column:
    """A column's heading; its unit stands below the name, empty for words."""

    name: str
    unit: str = ""
    numeric: bool = True

    @property
    def heading(self) -> str:
        """Name and unit in a line."""
        if not self.unit:
            return self.name
        return f"{self.name}, {self.unit}" if "(" in self.unit else f"{self.name} ({self.unit})"


@dataclass(frozen=True)
class Row:
    """One row; the first cell is its heading.

    Muted rows are those of subjects that are not scored, strained ones those that are read with care.
    """

    cells: tuple[Cell, ...]
    muted: bool = False
    strained: bool = False
    summary: bool = False


@dataclass(frozen=True)
class Table:
    """A captioned table.

    Raises:
        ValueError: A row has another number of cells than the table has columns.
    """

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    note: str = field(default="")

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row.cells) != len(self.columns):
                raise ValueError(
                    f"table {self.caption!r}: {len(row.cells)} cells under {len(self.columns)} columns"
                )


def words(*names: str) -> tuple[Column, ...]:
    """Return columns of words."""
    return tuple(Column(name, numeric=False) for name in names)


def body(rows: Sequence[Sequence[Cell]]) -> tuple[Row, ...]:
    """Return plain rows."""
    return tuple(Row(tuple(cells)) for cells in rows)


def of_records(records: Sequence[Mapping[str, str]], caption: str = "") -> Table:
    """Return a table of texts by column name; a dash where a row lacks one of the first row's columns."""
    names = list(records[0]) if records else []
    columns = (*words(*names[:1]), *(Column(name) for name in names[1:]))
    return Table(caption, columns, body([[row.get(name, MISSING) for name in names] for row in records]))


def markdown(table: Table) -> str:
    """Return a table as Markdown, its note below it; numbers stand at the right.

    The caption is left to the heading above, and muted rows to the cell that says why they are.
    """
    heads = [column.heading for column in table.columns]
    rules = ["---:" if column.numeric else "---" for column in table.columns]
    rows = [[_plain(cell) for cell in row.cells] for row in table.rows]
    lines = [_line(heads), f"|{'|'.join(rules)}|", *map(_line, rows)]
    return "\n".join([*lines, "", table.note] if table.note else lines)


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |"


def _plain(cell: Cell) -> str:
    """Return a cell as Markdown."""
    if isinstance(cell, Strong):
        return f"**{cell.text}**"
    return cell if isinstance(cell, str) else " ".join(f"[{link.text}]({link.href})" for link in cell)
