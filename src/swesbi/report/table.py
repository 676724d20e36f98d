"""A table is a dataframe and the columns that are shown of it; HTML and LaTeX are its renderings.

HTML is set by the macro of ``page``; CSV and sheets of Excel are the dataframe alone. LaTeX needs the
packages booktabs, graphicx and longtable. Symbols stand as k_0, k_ATP, k_SR and D_T; each rendering sets
them in its own way.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import pandas as pd

from swesbi.artefacts import atomic_path
from swesbi.report.numbers import MISSING, SYMBOL, formatted, span

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

MARK: Final = "mark"
"""The column of the dataframe that says how a row is set: one of the next three, or nothing."""
MUTED, DOUBTFUL, SUMMARY = "muted", "doubtful", "summary"
GROUP: Final = "group"
"""The column of a dataframe whose values head the rows below them in LaTeX."""
SPECIAL: Final = str.maketrans(
    {character: rf"\{character}" for character in "&%$#{}"}
    | {
        "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "|": r"\textbar{}",
        "<": r"\textless{}", ">": r"\textgreater{}", "_": r"\_\allowbreak{}", "χ": r"$\chi$", "±": r"$\pm$",
        "→": r"$\rightarrow$", "−": "$-$", "–": "--", "⁻": r"\textsuperscript{$-$}",
        "¹": r"\textsuperscript{1}", "²": r"\textsuperscript{2}",
    }
)  # fmt: skip
EPOCH: Final = (1980, 1, 1, 0, 0, 0)
"""The first date that a ZIP archive knows; stands where openpyxl writes the time of writing."""
CORE: Final = "docProps/core.xml"
DATES: Final = re.compile(rb">\d{4}-\d\d-\d\dT[\d:]+Z<")
WIDEST: Final = 60


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


def text(plain: str) -> str:
    """Return text for LaTeX: special characters escaped, symbols as mathematics, names may break at "_"."""
    parts = SYMBOL.split(plain)
    return parts[0].translate(SPECIAL) + "".join(
        rf"${letter}_\mathrm{{{index}}}$" + rest.translate(SPECIAL)
        for letter, index, rest in zip(parts[1::3], parts[2::3], parts[3::3], strict=True)
    )


def latex(table: Table, label: str) -> str:
    """Return a table as a longtable, its note below the caption; heads of numbers are turned.

    Where its dataframe has a column ``GROUP`` of several values, these are headings.
    """
    layout = "".join("r" if column.numeric else "l" for column in table.columns)
    head = rf"    \toprule {' & '.join(map(_head, table.columns))} \\ \midrule"
    return "\n".join(
        [
            r"{\scriptsize\setlength{\tabcolsep}{2.5pt}",
            rf"\begin{{longtable}}{{@{{}}{layout}@{{}}}}",
            rf"    \caption{{{text(table.caption)} {text(table.note)}}}\label{{tab:{label}}}\\",
            rf"{head} \endfirsthead",
            rf"{head} \endhead",
            r"    \bottomrule \endlastfoot",
            *_body(table),
            r"\end{longtable}}",
            "",
        ]
    )


def _head(column: Column) -> str:
    head = text(column.heading)
    return rf"\rotatebox{{90}}{{{head}}}" if column.numeric else head


def _body(table: Table) -> Iterator[str]:
    groups = list(table.frame.get(GROUP, [""] * len(table.frame)))
    several, before = len(set(groups)) > 1, ""
    across = rf"\multicolumn{{{len(table.columns)}}}{{@{{}}l}}"
    for group, row in zip(groups, table.rows, strict=True):
        if several and group != before:
            yield rf"    \addlinespace {across}{{\textit{{{text(group)}}}}} \\*"
            before = group
        yield f"    {' & '.join(map(_cell, row.cells))} \\\\"


def _cell(cell: Cell) -> str:
    return rf"\textbf{{{text(cell.text)}}}" if isinstance(cell, Strong) else text(str(cell))


def write_workbook(path: Path, sheets: Mapping[str, pd.DataFrame]) -> None:
    """Write tables as sheets: names in bold, which stay in view; what is missing is an empty cell."""
    from openpyxl import Workbook  # a third of a second, for this alone

    book = Workbook()
    book.remove(book.worksheets[0])
    for name, table in sheets.items():
        _fill(book.create_sheet(name), table)
    written = io.BytesIO()
    book.save(written)
    with atomic_path(path) as temporary:
        temporary.write_bytes(_undated(written.getvalue()))


def _fill(sheet: Worksheet, table: pd.DataFrame) -> None:
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    cells = table.astype(object).where(table.notna(), None)
    sheet.append(list(map(str, table.columns)))
    for values in cells.to_numpy().tolist():
        sheet.append(values)
    for row in sheet.iter_rows():
        for cell in row:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # a text that begins with = is no formula
    for number, name in enumerate(table.columns, start=1):
        sheet.cell(1, number).font = Font(bold=True)
        longest = max(map(len, map(str, [name, *table[name].dropna()])))
        sheet.column_dimensions[get_column_letter(number)].width = min(longest, WIDEST) + 2
    sheet.freeze_panes = "B2"


def _undated(content: bytes) -> bytes:
    """Return a workbook without the time of its writing."""
    undated = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as dated,
        zipfile.ZipFile(undated, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name in dated.namelist():
            member = dated.read(name)
            bare = DATES.sub(rb">1980-01-01T00:00:00Z<", member) if name == CORE else member
            archive.writestr(zipfile.ZipInfo(name, EPOCH), bare, zipfile.ZIP_DEFLATED)
    return undated.getvalue()
