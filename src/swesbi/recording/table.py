"""Tables as they come from the field, read cell by cell: every complaint has row, column and value."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray, TextArray
from swesbi.recording.content import NUMBER, delimiter_of, in_one_line, records, text_of
from swesbi.recording.problems import Problem, RecordingError, raise_any

SHOWN_ROWS: Final = 5
SIMILAR: Final = 0.85
"""Likeness of a column's name from which it is taken for a slip of the pen."""
MISSING: Final = ("", "NaN", "nan", "NAN")  # MATLAB writes an empty number as NaN
DECIMAL_COMMA: Final = r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?"
DECIMAL_POINT: Final = r"[+-]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
HEADER: Final = "name them in the first row, separated by commas (or semicolons)"


def shortest(value: float) -> str:
    """Return 7 for 7.0, and otherwise the shortest text that Python reads back as the same number."""
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else repr(value).replace("nan", "NaN")


@dataclass(frozen=True)
class Place:
    """Where a cell of a translated table stands in the file: column, text, and how it was understood."""

    column: str
    text: str
    read_as: str = ""


@dataclass(frozen=True)
class TextTable:
    """The cells of the columns that are used, as text, and the problems found in them so far.

    Attributes:
        source: The file, for messages.
        cells: The columns by name; shape (n,) each.
        rows: Where each row of ``cells`` stands in the file.
        unit: What ``rows`` counts: "row" of a text file, or "element" of a vector.
        ignored: Columns of the file that are not used.
        problems: Grows with every check; :meth:`finish` raises them together.
        place: Of a translated table: where a cell, by its index and column, stands in the file.
        units: Units that are stated of columns, by the file's names or by its ``recording.yaml``.
    """

    source: str
    cells: Mapping[str, TextArray]
    rows: IntArray
    unit: str = "row"
    ignored: tuple[str, ...] = ()
    problems: list[Problem] = field(default_factory=list)
    place: Callable[[int, str], Place] | None = None
    units: Mapping[str, str] = field(default_factory=dict)

    def number(
        self, column: str, low: float, high: float, remedy: str, *, may_be_empty: bool = False
    ) -> FloatArray:
        """Return a column of numbers within [low, high]; NaN where empty, which may be allowed, or wrong."""
        import pandas as pd  # a third of a second, which whoever only reads the configuration need not wait

        text = self.cells[column]
        values = np.asarray(pd.to_numeric(text, errors="coerce"), dtype=np.float64)
        empty = np.isin(text, MISSING) & may_be_empty
        known = np.isfinite(values)
        written = "write a number with a decimal point" + (", or nothing" if may_be_empty else "")
        self.flag(column, ~known & ~empty, "is not a number", written)
        outside = known & ~((values >= low) & (values <= high))
        self.flag(column, outside, f"is outside [{low:g}, {high:g}]", remedy)
        return np.where(known, values, np.nan)

    def integer(self, column: str, low: int, high: int, remedy: str) -> IntArray:
        """Return a column of whole numbers within [low, high]; what is wrong becomes ``low``."""
        values = self.number(column, low, high, remedy)
        fraction = np.isfinite(values) & (values != np.round(values))
        self.flag(column, fraction, "is not a whole number", "correct the cell")
        return np.clip(np.nan_to_num(values, nan=low), low, high).astype(np.int64)

    def choice(self, column: str, allowed: Sequence[str]) -> TextArray:
        """Return a column whose cells should all be among ``allowed``."""
        text = self.cells[column]
        options = ", ".join(allowed)
        wrong = ~np.isin(text, allowed)
        self.flag(column, wrong, f"is none of {options}", "write one of them, in this spelling")
        return text

    def unique(self, columns: Sequence[str]) -> None:
        """Refuse rows that repeat the ``columns`` of an earlier one by their values: 1 and 1.0 are one."""
        repeated = stood_before(_by_value(self.cells[name]) for name in columns)
        self.flag(columns[-1], repeated, f"repeats the {', '.join(columns)} of an earlier row", "keep one")

    def refuse_lookalikes(self, remedies: Mapping[str, str], resembles: Callable[[str, str], bool]) -> None:
        """Refuse a column that nobody reads and that looks like one that is read and is not there.

        Args:
            remedies: By each column that is read: what to call it.
            resembles: Whether a lower-case name is another spelling of that column.
        """
        absent = [name for name in remedies if name not in self.cells]
        for ignored in self.ignored:
            lowered = ignored.strip().lower()
            misspelt = [] if lowered in remedies else difflib.get_close_matches(lowered, absent, 1, SIMILAR)
            alike = [*(name for name in absent if resembles(lowered, name)), *misspelt]
            if alike:
                reason = f"is not read, and looks like {alike[0]}"
                remedy = f"{remedies[alike[0]]}, or by a name that is less like it"
                self.problems.append(Problem(self.source, reason, remedy, column=ignored))

    def spelled_once(self, column: str) -> None:
        """Refuse a text that differs from an earlier one in case, zeros, blanks or signs only."""
        text = self.cells[column].tolist()
        alike = stood_before([[spelling(cell) for cell in text]]) & ~stood_before([text])
        reason = f"differs from an earlier {column} in case, zeros, blanks or signs only"
        self.flag(column, alike, reason, "rename one")

    def flag(self, column: str, wrong: BoolArray, reason: str, remedy: str) -> None:
        """Note a problem for each wrong row: the first few one by one, the rest as a number."""
        rows = np.flatnonzero(wrong)
        for index in rows[:SHOWN_ROWS]:
            self.note(int(index), column, reason, remedy)
        if (more := len(rows) - SHOWN_ROWS) > 0:
            last = self.rows[rows[-1]]
            text = f"likewise in {more} more {self.unit}s, the last of them {last}: {reason}"
            self.problems.append(Problem(self.source, text, remedy, column=column))

    def note(self, index: int, column: str, reason: str, remedy: str) -> None:
        """Note a problem of one cell."""
        value, row = str(self.cells[column][index]), int(self.rows[index])
        if self.place is not None:
            place = self.place(index, column)
            column, value, reason = place.column, place.text, f"{place.read_as}{reason}"
        self.problems.append(Problem(self.source, reason, remedy, row, column, value, self.unit))

    def finish(self) -> None:
        """Raise all problems found.

        Raises:
            RecordingError: There is at least one.
        """
        raise_any(self.problems)


def spelling(name: str) -> str:
    """Return what of a name counts: letters in one case, numbers without zeros before them, signs between.

    Of signs alone all counts.
    """
    lowered = unicodedata.normalize("NFKC", name).lower()  # an accent is a sign of its own, or of its letter
    without = re.sub(r"(?<![0-9])[\W_]+|[\W_]+(?![0-9])", "", lowered)
    return re.sub(r"(?<![0-9])0+(?=[0-9])", "", re.sub(r"[\W_]+", "-", without)) or name


def _by_value(cells: TextArray) -> list[str]:
    """Return texts (n,) of which those of equal numbers are equal."""
    return [f"{float(cell):.15g}" if re.fullmatch(NUMBER, cell) else cell for cell in cells]


def stood_before(columns: Iterable[Iterable[str]]) -> BoolArray:
    """Tell which of n rows of texts, given column by column, stood before; shape (n,)."""
    rows = ["\0".join(row) for row in zip(*columns, strict=True)]  # no text of a table holds a zero byte
    known: set[str] = set()
    before: list[bool] = []
    for row in rows:
        before.append(row in known)
        known.add(row)
    return np.array(before, dtype=np.bool_)


def check_names(source: str, names: Sequence[str], required: Sequence[str], remedy: str) -> list[Problem]:
    """Return the problems of a table's column names: missing ones, and ones that stand there twice."""
    problems = []
    if missing := [name for name in required if name not in names]:
        known = ", ".join(name for name in names if name)
        reason = f"lacks the columns {', '.join(missing)}; it has {known or 'none'}{_close(missing, names)}"
        problems.append(Problem(source, reason, remedy, row=None))
    if twice := sorted({name for name in names if name and list(names).count(name) > 1}):
        problems.append(Problem(source, f"names a column twice: {', '.join(twice)}", "rename or remove one"))
    return problems


def _close(missing: Sequence[str], names: Sequence[str]) -> str:
    lowered = {name.lower(): name for name in names}
    alike = {name: difflib.get_close_matches(name, lowered, n=1, cutoff=0.8) for name in missing}
    pairs = [f"{lowered[close[0]]!r} should be {name!r}" for name, close in alike.items() if close]
    return f" ({', '.join(pairs)}?)" if pairs else ""


def read_table(
    path: Path, required: Sequence[str], optional: Sequence[str] = (), texts: Sequence[str] = ()
) -> TextTable:
    """Read the columns of a CSV file that are used; others are ignored, and so are lines from ``#`` on.

    The delimiter is the one (comma, semicolon, tab) under which the header names most of the columns. Behind
    semicolon and tab, a comma within a number is a decimal comma, unless some number has a decimal point.

    Args:
        path: The file.
        required: Columns that it must have.
        optional: Columns that it may have.
        texts: Those among them whose cells are no numbers, whatever they look like.

    Raises:
        RecordingError: The file is missing, empty, a workbook, not UTF-8, ragged, or lacks columns.
    """
    text = text_of(path)
    delimiter = delimiter_of(text, (*required, *optional))
    table = below_names(path, records(path, text, delimiter), required, optional)
    return table if delimiter == "," else with_decimal_points(table, texts)


def below_names(
    path: Path,
    rows: Iterable[tuple[int, list[str]]],
    required: Sequence[str],
    optional: Sequence[str] = (),
) -> TextTable:
    """Return the wanted columns of the rows below the first that is not empty, which names them.

    Raises:
        RecordingError: There is no row, rows are ragged, or columns are missing or named twice.
    """
    records = list(rows)
    first = next((place for place, (_, cells) in enumerate(records) if cells), len(records))
    if first == len(records):
        raise RecordingError(Problem(str(path), "is empty", HEADER))
    row, header = records[first]
    names = [in_one_line(name) for name in header]
    raise_any(check_names(f"{path}, row {row}", names, required, HEADER))
    wanted = [name for name in (*required, *optional) if name in names]
    return _table(path, records[first + 1 :], names, wanted)


def _table(
    path: Path, records: Sequence[tuple[int, list[str]]], names: Sequence[str], wanted: Sequence[str]
) -> TextTable:
    """Collect the wanted cells; rows of another length are refused, but for blank ones at the end."""
    whole = [(row, cells) for row, cells in records if len(cells) == len(names)]
    while whole and not any(whole[-1][1][names.index(name)].strip() for name in wanted):
        whole.pop()
    last = whole[-1][0] if whole else 0
    other = [(row, cells) for row, cells in records if len(cells) != len(names)]
    sizes = [(row, len(cells) if any(cell.strip() for cell in cells) else 0) for row, cells in other]
    raise_any(_ragged(path, [(row, size) for row, size in sizes if size or row < last], len(names)))
    if not whole:
        raise RecordingError(Problem(str(path), "holds no data row", "write at least one below the header"))
    places = {name: names.index(name) for name in wanted}
    columns = {name: column_of(cells[at].strip() for _, cells in whole) for name, at in places.items()}
    ignored = tuple(name for name in names if name and name not in wanted)
    return TextTable(str(path), columns, np.array([row for row, _ in whole], dtype=np.int64), ignored=ignored)


def column_of(values: Iterable[str]) -> TextArray:
    """Return texts as a column (n,)."""
    return np.array(list(values), dtype=np.object_)


def _ragged(path: Path, wrong: Sequence[tuple[int, int]], expected: int) -> list[Problem]:
    remedy = "remove blank lines, and decimal commas, and complete the row"
    problems = [
        Problem(str(path), f"has {size} cells, the header has {expected}", remedy, row=row)
        for row, size in wrong[:SHOWN_ROWS]
    ]
    if len(wrong) > SHOWN_ROWS:
        reason = f"{len(wrong) - SHOWN_ROWS} more rows differ from the header in their number of cells"
        problems.append(Problem(str(path), reason, remedy))
    return problems


def with_decimal_points(table: TextTable, kept: Sequence[str]) -> TextTable:
    """Turn decimal commas into points; a file that uses both is left to the check of its numbers.

    Args:
        table: As it was read.
        kept: Columns that are no numbers, and stay as they are.
    """
    numbers = {name: cells for name, cells in table.cells.items() if name not in kept}
    comma = {name: _written_as(DECIMAL_COMMA, cells) for name, cells in numbers.items()}
    if not any(cells.any() for cells in comma.values()):
        return table
    if any(_written_as(DECIMAL_POINT, cells).any() for cells in numbers.values()):
        reason = "has a comma, while other numbers of the file have a decimal point"
        for name, with_comma in comma.items():
            table.flag(name, with_comma, reason, "use one decimal sign throughout")
        table.finish()
    changed = {
        name: column_of(
            cell.replace(",", ".") if written else cell
            for cell, written in zip(cells, comma[name], strict=True)
        )
        for name, cells in numbers.items()
    }
    return replace(table, cells={**table.cells, **changed})


def _written_as(pattern: str, cells: TextArray) -> BoolArray:
    """Tell which texts (n,) are of a pattern; shape (n,)."""
    return np.array([re.fullmatch(pattern, cell) is not None for cell in cells], dtype=np.bool_)
