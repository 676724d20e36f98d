"""A table as the page shows it: every cell is text that a reader can use as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Link:
    """A link to a file, relative to the page."""

    text: str
    href: str


Cell = str | tuple[Link, ...]
"""Text (``Markup`` passes as it is) or links."""


@dataclass(frozen=True)
class Column:
    """A column's heading; its unit stands below the name, empty for words."""

    name: str
    unit: str = ""
    numeric: bool = True


@dataclass(frozen=True)
class Row:
    """One row; the first cell is its heading. Muted rows are those of subjects that are not scored."""

    cells: tuple[Cell, ...]
    muted: bool = False
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
