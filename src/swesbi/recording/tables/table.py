"""A table of text, checked cell by cell: every complaint has row, column and value."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray, TextArray
from swesbi.base.terminal import hidden_signs, visible
from swesbi.recording.problems import Problem, RecordingError, raise_any

SHOWN_ROWS: Final = 5
SIMILAR: Final = 0.85
"""Likeness of a column's name from which it is taken for a slip of the pen."""
MISSING: Final = ("", "NaN", "nan", "NAN")  # MATLAB writes an empty number as NaN
NUMBER: Final = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
DECIMAL_COMMA: Final = r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?"
DECIMAL_POINT: Final = r"[+-]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
HEADER: Final = "name them in the first row, separated by commas, semicolons or tabs"
Row = tuple[int, list[str]]
"""A row of a file: its place, from 1, and its cells."""
Place = tuple[str, str, str]
"""Where a cell of a translated table stands in the file: column, text, and how it was understood."""


def shortest(value: float) -> str:
    """Return 7 for 7.0, and otherwise the shortest text that Python reads back as the same number."""
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else repr(value).replace("nan", "NaN")


@dataclass(frozen=True)
class Table:
    """Columns of n rows as text, shape (n,) each, and the problems found in them so far.

    ``rows`` has where each stands in the file, counted in ``unit``: "row" of a text file, or "element" of a
    vector. ``closed`` are columns that cannot be used, ``ignored`` those of the file that are not,
    ``differing`` those of them in which the rows differ; ``left_out`` says what else is not used, a sentence
    each. Where ``decimal_comma``, a comma in a number may be a decimal one; where ``copies_allowed``, beats
    or repeats that stand twice are meant. ``units`` are stated by the names of the file or by its
    ``recording.yaml``. ``place`` tells of a translated table where a cell, by its index and column, stands in
    the file. ``remedy`` is what to do where a column is missing. ``problems`` grow with every check;
    :meth:`finish` raises them together.
    """

    source: str
    cells: Mapping[str, TextArray]
    rows: IntArray
    unit: str = "row"
    header_row: int = 1
    decimal_comma: bool = False
    closed: Mapping[str, Problem] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    copies_allowed: bool = False
    problems: list[Problem] = field(default_factory=list)
    place: Callable[[int, str], Place] | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    remedy: str = HEADER

    def using(
        self, required: Sequence[str], optional: Sequence[str] = (), texts: Sequence[str] = ()
    ) -> Table:
        """Return the columns that are used, of which none may be closed.

        Cells of ``texts`` are no numbers, whatever they look like.
        """
        if missing := [name for name in required if name not in self.cells]:
            names = [*self.cells, *self.ignored]
            place = f"{self.source}, row {self.header_row}" if self.unit == "row" else self.source
            raise RecordingError(_lacking(place, missing, names, (*required, *optional), self.remedy))
        wanted = [name for name in (*required, *optional) if name in self.cells]
        raise_any([self.closed[name] for name in wanted if name in self.closed])
        others = [name for name in self.cells if name not in wanted]
        used = replace(
            self,
            cells={name: self.cells[name] for name in wanted},
            ignored=(*self.ignored, *others),
            differing=(*self.differing, *(name for name in others if len({*self.cells[name].tolist()}) > 1)),
        )
        return used.with_decimal_points(texts) if self.decimal_comma else used

    def with_empty(self, columns: Sequence[str]) -> Table:
        """Return the table with those of the columns that it lacks, empty."""
        empty = column_of([""] * len(self.rows))
        return replace(self, cells={**dict.fromkeys(columns, empty), **self.cells})

    def number(
        self, column: str, low: float, high: float, remedy: str, *, may_be_empty: bool = False
    ) -> FloatArray:
        """Return a column of numbers within [low, high]; NaN where empty, which may be allowed, or wrong."""
        text = self.cells[column]
        numbers = [float(cell) if _is_number(cell.strip()) else np.nan for cell in text]
        values = np.array(numbers, dtype=np.float64)
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
        broken = np.isfinite(values) & (values != np.round(values))
        self.flag(column, broken, "is not a whole number", "correct the cell")
        return np.clip(np.nan_to_num(values, nan=low), low, high).astype(np.int64)

    def choice(self, column: str, allowed: Sequence[str]) -> TextArray:
        """Return a column whose cells should all be among ``allowed``."""
        text = self.cells[column]
        reason = f"is none of {', '.join(allowed)}"
        self.flag(column, ~np.isin(text, allowed), reason, "write one of them, in this spelling")
        return text

    def unique(self, columns: Sequence[str], remedy: str = "keep one") -> None:
        """Refuse rows that repeat the ``columns`` of an earlier one by their values: 1 and 1.0 are one."""
        repeated = stood_before(_by_value(self.cells[name]) for name in columns)
        self.flag(columns[-1], repeated, f"repeats the {', '.join(columns)} of an earlier row", remedy)

    def refuse_lookalikes(self, remedies: Mapping[str, str], resembles: Callable[[str, str], bool]) -> None:
        """Refuse a column that nobody reads and that looks like one that is read and is not there.

        ``remedies`` say of each column that is read what to call it; ``resembles`` tells whether a lower-case
        name is another spelling of it.
        """
        absent = [name for name in remedies if name not in self.cells]
        for ignored in self.ignored:
            lowered = ignored.strip().lower()
            misspelt = [] if lowered in remedies else difflib.get_close_matches(lowered, absent, 1, SIMILAR)
            if alike := [*(name for name in absent if resembles(lowered, name)), *misspelt]:
                reason = f"is not read, and looks like {alike[0]}"
                remedy = f"{remedies[alike[0]]}, or by a name that is less like it"
                self.problems.append(Problem(self.source, reason, remedy, column=ignored))

    def spelled_once(self, column: str) -> None:
        """Refuse a text that differs from an earlier one in case, zeros, blanks or signs only."""
        text = self.cells[column].tolist()
        alike = stood_before([[spelling(cell) for cell in text]]) & ~stood_before([text])
        reason = f"differs from an earlier {column} in case, zeros, blanks or signs only"
        self.flag(column, alike, reason, "rename one")

    def with_decimal_points(self, texts: Sequence[str]) -> Table:
        """Return the table with points for decimal commas, but in ``texts``; one of both kinds is refused."""
        numbers = {name: cells for name, cells in self.cells.items() if name not in texts}
        comma = {name: _written_as(DECIMAL_COMMA, cells) for name, cells in numbers.items()}
        if not any(cells.any() for cells in comma.values()):
            return self
        if any(_written_as(DECIMAL_POINT, cells).any() for cells in numbers.values()):
            reason = "has a comma, while other numbers of the file have a decimal point"
            for name, with_comma in comma.items():
                self.flag(name, with_comma, reason, "use one decimal sign throughout")
            self.finish()
        changed = {
            name: column_of(
                cell.replace(",", ".") if written else cell
                for cell, written in zip(cells, comma[name], strict=True)
            )
            for name, cells in numbers.items()
        }
        return replace(self, cells={**self.cells, **changed})

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
            column, value, read_as = self.place(index, column)
            reason = f"{read_as}{reason}"
        self.problems.append(Problem(self.source, reason, remedy, row, column, value, self.unit))

    def finish(self) -> None:
        """Raise all problems found."""
        raise_any(self.problems)


def table_of(source: str, rows: Sequence[Row], remedy: str, *, decimal_comma: bool = False) -> Table:
    """Return the table below the first row that is not empty, which names the columns.

    A column without a name is called by its place, and left out where it is empty. Blank rows at the end do
    not count.
    """
    first = next((number for number, (_, cells) in enumerate(rows) if _is_filled(cells)), len(rows))
    if first == len(rows):
        raise RecordingError(Problem(source, "is empty", remedy))
    header_row, header = rows[first]
    names = [in_one_line(name) for name in header]
    if twice := sorted({name for name in names if name and names.count(name) > 1}):
        reason = f"names a column twice: {', '.join(twice)}"
        raise RecordingError(Problem(f"{source}, row {header_row}", reason, "rename or remove one"))
    last = max(number for number, (_, cells) in enumerate(rows) if _is_filled(cells))
    below = rows[first + 1 : last + 1]
    raise_any(_ragged(source, below, header_row, names))
    if not below:
        raise RecordingError(Problem(source, "holds no data row", "write at least one below the header"))
    columns = {
        name or f"column {number + 1}": column_of(cells[number].strip() for _, cells in below)
        for number, name in enumerate(names)
    }
    kept = {name: cells for name, cells in columns.items() if name in names or any(cells.tolist())}
    places = np.array([place for place, _ in below], dtype=np.int64)
    return Table(source, kept, places, header_row=header_row, decimal_comma=decimal_comma, remedy=remedy)


def _is_filled(cells: Sequence[str]) -> bool:
    return any(cell.strip() for cell in cells)


def _is_number(text: str) -> bool:
    return re.fullmatch(NUMBER, text) is not None


def _ragged(source: str, rows: Sequence[Row], header_row: int, names: Sequence[str]) -> list[Problem]:
    """Return what is wrong with rows of other numbers of cells than the header."""
    size = len(names)
    sizes = [(place, len(cells) if _is_filled(cells) else 0) for place, cells in rows]
    wrong = [(place, number) for place, number in sizes if number != size]
    filled = [cells for _, cells in rows if _is_filled(cells)]
    if filled and all(len(cells) == size + 1 for cells in filled):
        if not any(cells[-1].strip() for cells in filled):
            reason = "its rows end in a delimiter, and the row of names does not"
            return [Problem(source, reason, "remove it, or end the row of names in one too")]
        first = [cells[0].strip() for cells in filled]
        if len(filled) > 1 and (
            first == [str(n + 1) for n in range(len(first))] or not any(map(_is_number, first))
        ):
            reason = "each row has a first cell that the row of names does not name, as R writes row names"
            return [Problem(source, reason, "write the table without row names, or name their column")]
    if filled and not names[-1] and all(len(cells) == size - 1 for cells in filled):
        return [Problem(source, "the row of names ends in a delimiter, and the others do not", "remove it")]
    widths = sorted(len(cells) for cells in filled)
    usual = widths[len(widths) // 2] if widths else 0
    wide = [place for place, cells in rows if len(cells) == usual and not any(map(_is_number, cells))]
    if size < usual and wide:
        reason = f"has {size} cells, and the rows from {wide[0]} on have {usual}"
        remedy = (
            f"remove what stands above the names of columns, or say `table: {{ header_row: {wide[0]} }}` in "
            "recording.yaml"
        )
        return [Problem(source, reason, remedy, row=header_row)]
    remedy = "remove blank lines and others that are no rows, and decimal commas, and complete the row"
    problems = [
        Problem(source, f"has {number} cells, the header has {size}", remedy, row=place)
        for place, number in wrong[:SHOWN_ROWS]
    ]
    if len(wrong) > SHOWN_ROWS:
        reason = f"{len(wrong) - SHOWN_ROWS} more rows differ from the header in their number of cells"
        problems.append(Problem(source, reason, remedy))
    return problems


def _lacking(
    place: str, missing: Sequence[str], names: Sequence[str], known: Sequence[str], remedy: str
) -> Problem:
    """Return what to say of columns that are not there, and of those that may be meant."""
    other = {visible(name).lower(): name for name in names if name not in known}
    pairs = []
    for name in missing:
        alike = difflib.get_close_matches(name, other, n=1, cutoff=0.8)
        alike = alike or [one for one in other if name.startswith(f"{one}_")]
        if alike:
            meant = other[alike[0]]
            pairs.append(f"{meant!r} should be {name!r}{hidden_signs(meant)}")
    said = f" ({', '.join(pairs)}?)" if pairs else ""
    reason = f"lacks the columns {', '.join(missing)}; it has {', '.join(names) or 'none'}{said}"
    if len(names) == 1 and any(name in names[0] for name in missing):
        remedy = "separate the columns by commas, semicolons or tabs"
    elif any("*" in name for name in missing):
        remedy = (
            "name columns in full: those of samples under `table.samples`, in which order they are counted"
        )
    return Problem(place, reason, remedy)


def in_one_line(name: str) -> str:
    """Return the name of a column without line breaks and needless blanks."""
    return " ".join(name.split())


def spelling(name: str) -> str:
    """Return what of a name counts: letters in one case, numbers without zeros before them, signs between.

    Of signs alone all counts.
    """
    lowered = unicodedata.normalize("NFKC", name).lower()  # an accent is a sign of its own, or of its letter
    without = re.sub(r"(?<![0-9])[\W_]+|[\W_]+(?![0-9])", "", lowered)
    return re.sub(r"(?<![0-9])0+(?=[0-9])", "", re.sub(r"[\W_]+", "-", without)) or name


def stood_before(columns: Iterable[Iterable[str]]) -> BoolArray:
    """Tell which of n rows of texts, given column by column, stood before; shape (n,)."""
    rows = ["\0".join(row) for row in zip(*columns, strict=True)]  # no text of a table holds a zero byte
    known: set[str] = set()
    before: list[bool] = []
    for row in rows:
        before.append(row in known)
        known.add(row)
    return np.array(before, dtype=np.bool_)


def column_of(values: Iterable[str]) -> TextArray:
    """Return texts as a column (n,)."""
    return np.array(list(values), dtype=np.object_)


def _by_value(cells: TextArray) -> list[str]:
    """Return texts (n,) of which those of equal numbers are equal."""
    return [f"{float(cell):.15g}" if _is_number(cell) else cell for cell in cells]


def _written_as(pattern: str, cells: TextArray) -> BoolArray:
    """Tell which texts (n,) are of a pattern; shape (n,)."""
    return np.array([re.fullmatch(pattern, cell) is not None for cell in cells], dtype=np.bool_)
