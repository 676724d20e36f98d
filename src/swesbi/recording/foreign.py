"""Tables of other tools, translated into the columns of this project before they are read as samples.

Cells stay text: a unit is a decimal factor, so that 245.3 cm/s is 2.453 m/s to the last digit. Whatever is
refused later is named by the file's own column and value.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.base.arrays import IntArray
from swesbi.recording.cohort import EXCEL
from swesbi.recording.columns import (
    COLUMNS,
    EVENT,
    FREE_OPTIONAL,
    FREE_REQUIRED,
    MEASURED,
    MODULUS,
    SHEAR_MODULUS,
    SPEED,
    STANDARD_ERROR,
    TIME,
)
from swesbi.recording.content import NUMBER, csv_rows, in_one_line
from swesbi.recording.layout import (
    COUNTED,
    SUBJECT,
    TableLayout,
)
from swesbi.recording.mat_table import read_mat_table
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.table import (
    Place,
    TextTable,
    below_names,
    column_of,
    spelling,
    with_decimal_points,
)
from swesbi.recording.units import MODULUS_UNITS, UNITS, unit_of
from swesbi.recording.workbook import sheet_rows

SEE_LAYOUT: Final = "correct the key `columns` of recording.yaml, or the table"
THREE: Final = "3"  # E = 3 mu of an incompressible, isotropic tissue


@dataclass(frozen=True)
class Wanted:
    """Which columns of this project a recording has: those that it must have, and those that it may have."""

    required: tuple[str, ...]
    optional: tuple[str, ...] = ()

    @property
    def of_own_form(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Columns that a table of this project's form must and may have; what was measured is one of two."""
        return tuple(name for name in self.required if name != SPEED), (SPEED, MODULUS, *self.optional)

    def values(self, layout: TableLayout) -> dict[str, str | int | float]:
        """Return what the layout says of columns that the tables lack, as far as they are wanted."""
        every = (*self.required, *self.optional)
        return {column: value for column, value in layout.values.items() if column in every}


GATED: Final = Wanted(COLUMNS)
FREE: Final = Wanted((*FREE_REQUIRED, SPEED), (*FREE_OPTIONAL, EVENT))
PHASE: Final = "phase_index"


@dataclass(frozen=True)
class Cells:
    """Cells under this project's names, each with where it stands in the file.

    Attributes:
        cells: As this project reads them.
        written: As they stand in the file.
        columns: What the file calls the column of each; the same shape.
        rows: Row of the file.
    """

    cells: pd.DataFrame
    written: pd.DataFrame
    columns: pd.DataFrame
    rows: IntArray


def is_free(path: Path, layout: TableLayout) -> bool:
    """Tell whether a recording is free-running: instants, no phases; none that cannot be read."""
    return has_no_phases(placed_by(path, layout))


def has_no_phases(places: Sequence[str]) -> bool:
    """Tell whether columns of ``placed_by`` are those of a free-running recording."""
    return PHASE not in places and TIME in places


def placed_by(path: Path, layout: TableLayout) -> tuple[str, ...]:
    """Return which columns a recording has that place it in the cycle: of phases, instants and events.

    None of a file that cannot be read.
    """
    names = {column: str(layout.source(column)) for column in (PHASE, TIME, EVENT)}
    try:
        if path.suffix.lower() == ".mat":
            known = _names_in_mat(path, tuple(names.values()))
        else:
            rows, _ = _rows(path, layout)
            known = [in_one_line(cell) for cell in (rows[0][1] if rows else [])]
    except RecordingError as error:
        # a vector that cannot be used is there all the same
        known = [problem.column for problem in error.problems if problem.column]
    return tuple(column for column, name in names.items() if name in known or column in layout.values)


def read_foreign(path: Path, layout: TableLayout, subject: str, wanted: Wanted = GATED) -> TextTable:
    """Return one subject's samples in the columns of this project, or in kPa where a modulus was measured.

    Args:
        path: The table: .csv, .mat, .xlsx or .xlsm.
        layout: How it differs.
        subject: Whose rows are wanted, where it is a table of several.
        wanted: The columns of this project.

    Raises:
        RecordingError: The file is no such table, lacks a column or has no row of the subject.
    """
    table, sources = _source(path, layout, wanted)
    units = {
        column: unit
        for column, names in sources.items()
        if column in UNITS and (unit := unit_of(path, column, names, layout.units.get(column)))
    }
    own = _of_subject(table, layout, subject)
    melted = _melted(table, own, sources)
    understood = _understood(melted, layout, units, wanted)

    def place(index: int, column: str) -> Place:
        source = SHEAR_MODULUS if column == MODULUS and SHEAR_MODULUS in sources else column
        if column in layout.values or source not in melted.columns:
            text = str(layout.values.get(column, ""))
            return Place(f"table.values.{column} of recording.yaml", text)
        name, text = melted.columns[source].iloc[index], melted.written[source].iloc[index]
        read_as = f"read in {units[source]} as {column} " if source in units else ""
        return Place(str(name), str(text), read_as)

    columns = {str(name): column_of(understood[name]) for name in understood}
    return TextTable(table.source, columns, melted.rows, unit=table.unit, place=place, units=units)


def _source(path: Path, layout: TableLayout, wanted: Wanted) -> tuple[TextTable, dict[str, tuple[str, ...]]]:
    """Return the columns of the file that are used, as text, and which of them each of ours is."""
    columns = [*wanted.required, *((SUBJECT,) if SUBJECT in layout.columns else ())]
    columns = [name for name in columns if name not in layout.values]
    optional = [name for name in wanted.optional if name not in layout.values]
    if path.suffix.lower() == ".mat":
        measured = _measured(layout, _names_in_mat(path, MEASURED))
        columns = [measured if name == SPEED else name for name in columns]
        named = {column: _single(path, layout.source(column)) for column in (*columns, *optional)}
        table = read_mat_table(
            path, [named[column] for column in columns], [named[column] for column in optional]
        )
        return table, {column: (name,) for column, name in named.items() if name in table.cells}
    rows, decimal_comma = _rows(path, layout)
    known = [in_one_line(cell) for cell in (rows[0][1] if rows else [])]
    columns = [_measured(layout, known) if name == SPEED else name for name in columns]
    # one that may be missing must be there all the same where the layout says what it is called
    columns += [name for name in optional if name in layout.columns or name in known]
    sources = {column: _matching(path, column, layout.source(column), known) for column in columns}
    table = below_names(path, rows, list(dict.fromkeys(name for names in sources.values() for name in names)))
    texts = [name for column in (SUBJECT, "status") for name in sources.get(column, ())]
    return (with_decimal_points(table, texts) if decimal_comma else table), sources


def _measured(layout: TableLayout, known: Sequence[str]) -> str:
    """Return what was measured: as the layout says, or else by this project's own names in the table."""
    own = [name for name in MEASURED if name in known]
    return own[0] if len(own) == 1 and not set(MEASURED) & set(layout.columns) else layout.measured


def _names_in_mat(path: Path, names: Sequence[str]) -> list[str]:
    return list(read_mat_table(path, (), names).cells)


def _rows(path: Path, layout: TableLayout) -> tuple[list[tuple[int, list[str]]], bool]:
    """Return the rows from that of the column names on."""
    if path.suffix.lower() in EXCEL:
        rows, decimal_comma = sheet_rows(path, layout.table.sheet), False
    else:
        records, decimal_comma = csv_rows(path)
        rows = list(records)
    first = layout.table.header_row or 1
    below = [(row, cells) for row, cells in rows if row >= first and any(cell.strip() for cell in cells)]
    return below, decimal_comma


def _single(path: Path, source: str | tuple[str, ...]) -> str:
    if isinstance(source, str) and "*" not in source:
        return source
    reason, remedy = "names several vectors of a .mat file", "save one vector, an element a sample"
    raise RecordingError(Problem(str(path), reason, remedy, value=str(source)))


def _matching(
    path: Path, column: str, source: str | tuple[str, ...], known: Sequence[str]
) -> tuple[str, ...]:
    """Return the file's columns that one of ours is: one, or several of a wide table."""
    if not isinstance(source, str):
        return source
    if "*" not in source:
        return (source,)
    pattern = re.compile(".*".join(map(re.escape, source.split("*"))), re.DOTALL)
    names = tuple(name for name in known if name and pattern.fullmatch(name))
    if not names:
        reason = f"stands for {column}, and matches no column; the table has {', '.join(filter(None, known))}"
        raise RecordingError(Problem(str(path), reason, SEE_LAYOUT, value=source))
    return names


def _of_subject(table: TextTable, layout: TableLayout, subject: str) -> pd.DataFrame:
    """Return the rows of one subject, or all of a table of one."""
    if SUBJECT not in layout.columns:
        return pd.DataFrame(table.cells)
    name = str(layout.source(SUBJECT))
    cells = pd.DataFrame(table.cells)
    own = cells[cells[name] == subject]
    if own.empty:
        known = list(dict.fromkeys(table.cells[name]))
        listed = ", ".join(known[:10]) + (", ..." if len(known) > 10 else "")
        remedy = f"write the name as in subjects.csv; it has {listed}"
        raise RecordingError(Problem(table.source, "has no row", remedy, column=name, value=subject))
    _check_whose(table, name, subject)
    return own


def _check_whose(table: TextTable, name: str, subject: str) -> None:
    """Refuse a shared table with rows that may be a subject's: without a name, or spelled nearly so.

    Raises:
        RecordingError: There are such rows.
    """
    names = table.cells[name]
    table.flag(name, names == "", "has no name, so it is nobody's row", "write the name in every row")
    like = [
        other for other in dict.fromkeys(names) if other != subject and spelling(other) == spelling(subject)
    ]
    reason = f"differs from {subject} in case, zeros, blanks or signs only"
    table.flag(name, np.isin(names, like), reason, "write one name in one way, or rename one of two persons")
    table.finish()


def rows_by_name(path: Path, layout: TableLayout) -> dict[str, int]:
    """Return how many rows of a shared table are of each name.

    Raises:
        RecordingError: The table cannot be read.
    """
    table, _ = _source(path, layout, Wanted(()))
    return dict(Counter(table.cells[str(layout.source(SUBJECT))].tolist()))


def _melted(table: TextTable, own: pd.DataFrame, sources: dict[str, tuple[str, ...]]) -> Cells:
    """Return a row a sample: of a table with a column a sample, its columns one after the other."""
    wide = {column: names for column, names in sources.items() if len(names) > 1}
    sizes = {len(names) for names in wide.values()}
    if len(sizes) > 1:
        counts = ", ".join(f"{column} {len(names)}" for column, names in wide.items())
        reason = f"has different numbers of columns for what has one a sample ({counts})"
        raise RecordingError(Problem(table.source, reason, SEE_LAYOUT))
    blocks = max(sizes, default=1)
    named = {column: names * blocks if len(names) == 1 else names for column, names in sources.items()}
    picked = [{column: names[block] for column, names in named.items()} for block in range(blocks)]
    parts = [pd.DataFrame({column: own[name] for column, name in one.items()}) for one in picked]
    labels = [pd.DataFrame(one, index=own.index) for one in picked]
    # row by row, the samples of a row together
    order = np.arange(blocks * len(own)).reshape(blocks, -1).T.ravel()
    cells = pd.concat(parts, ignore_index=True).iloc[order].reset_index(drop=True)
    columns = pd.concat(labels, ignore_index=True).iloc[order].reset_index(drop=True)
    rows = np.tile(table.rows[own.index.to_numpy()], blocks)[order]
    return Cells(cells, cells, columns, rows)


def _understood(melted: Cells, layout: TableLayout, units: Mapping[str, str], wanted: Wanted) -> pd.DataFrame:
    """Return the cells in this project's columns, units, words and numbers."""
    cells = melted.cells.copy()
    for column, unit in units.items():
        cells[column] = cells[column].map(_times(UNITS[column][unit]))
    if "fit_r2" in cells:
        cells["fit_r2"] = cells["fit_r2"].map(_fraction)
    if SHEAR_MODULUS in cells:
        cells[MODULUS] = cells.pop(SHEAR_MODULUS).map(_times(THREE))
        if units.get(STANDARD_ERROR) in MODULUS_UNITS:
            cells[STANDARD_ERROR] = cells[STANDARD_ERROR].map(_times(THREE))
    if layout.table.statuses and "status" in cells:
        cells["status"] = cells["status"].map(lambda word: layout.table.statuses.get(word, word))
    if layout.table.first_phase and "phase_index" in cells:
        from_first = _arithmetic(lambda number: number - layout.table.first_phase)
        cells["phase_index"] = cells["phase_index"].map(from_first)
    values = wanted.values(layout)
    for column, value in values.items():
        if value != COUNTED:
            cells[column] = str(value)
    for column in (name for name, value in values.items() if value == COUNTED):
        cells[column] = _counted(cells, column, melted.rows)
    return cells[[name for name in (*wanted.required, *wanted.optional, *MEASURED[1:]) if name in cells]]


def _counted(cells: pd.DataFrame, column: str, rows: IntArray) -> pd.Series[str]:
    """Return the numbers of phases of a repeat, or of samples of a phase and repeat, in the file's order.

    Where the samples of a phase stand side by side, the file's rows are counted.
    """
    within = {"phase_index": ["repeat"], "sample": ["phase_index", "repeat"]}[column]
    number = cells.groupby(within, sort=False).cumcount()
    if column == "phase_index":
        groups = [cells[name] for name in within]
        number = pd.Series(rows, cells.index).groupby(groups).transform(lambda row: pd.factorize(row)[0])
    return number.astype(str)


def _times(factor: str) -> Callable[[str], str]:
    """Return what multiplies a number that is written as text; other text stays as it is."""
    return _arithmetic(lambda number: number * Decimal(factor))


def _fraction(text: str) -> str:
    """Return a number that has its own per cent sign as a fraction; other text stays as it is."""
    number = text.removesuffix("%").rstrip()
    return _times("0.01")(number) if text.endswith("%") else text


def _arithmetic(change: Callable[[Decimal], Decimal]) -> Callable[[str], str]:
    def changed(text: str) -> str:
        if not re.fullmatch(NUMBER, text):
            return text
        number = change(Decimal(text))
        return format(number.normalize(), "f") if abs(number.adjusted()) < 30 else str(number)

    return changed
