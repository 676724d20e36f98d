"""A table of another tool in the columns, units and words of this project, one row a sample.

Cells stay text: a unit is a decimal factor, so that 245.3 cm/s is 2.453 m/s to the last digit. Whatever is
refused later is named by the file's own column and value.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Final

import numpy as np

from swesbi.base.arrays import IntArray, TextArray
from swesbi.recording.problems import refusal
from swesbi.recording.tables.layout import (
    COUNTED,
    EVERY_COLUMN,
    MEASURED,
    MODULUS,
    MODULUS_UNITS,
    OWN_FORM,
    PHASE,
    SHEAR_MODULUS,
    STANDARD_ERROR,
    SUBJECT,
    TEXTS,
    TIME,
    UNITS,
    TableLayout,
    stated_unit,
    unit_in_words,
)
from swesbi.recording.tables.table import NUMBER, Place, Table, column_of, spelling

THREE: Final = "3"  # E = 3 mu of an incompressible, isotropic tissue
Block = Mapping[str, str]
"""This project's column: that of the table, of one sample of each row."""


def is_free(table: Table) -> bool:
    """Tell whether a table in this project's columns is of a free-running recording: instants, no phases."""
    return TIME in table.cells and PHASE not in table.cells


def in_own_terms(table: Table, layout: TableLayout, subject: str = "") -> Table:
    """Return one subject's samples in the columns of this project, or in kPa where a modulus was measured.

    Columns that the layout does not name and that are not called as this project's are left out;
    ``differing`` has those in which rows of the recording differ.
    """
    blocks = _blocks(table, layout)
    used = list(dict.fromkeys(name for block in blocks for name in block.values()))
    units = _units(table.source, blocks, layout)
    own = of_subject(table, layout, subject)
    texts = [name for block in blocks for column, name in block.items() if column in TEXTS]
    whole = own.using(used, (), texts)
    _check_units_by_row(own, whole.ignored, blocks[0], units)
    # row by row, the samples of a row together
    order = np.arange(len(blocks) * len(own.rows)).reshape(len(blocks), -1).T.ravel()
    written = {
        column: np.concatenate([whole.cells[block[column]] for block in blocks])[order]
        for column in blocks[0]
    }
    rows = np.tile(own.rows, len(blocks))[order]
    cells = _understood(written, layout, units, rows)

    def place(index: int, column: str) -> Place:
        source = SHEAR_MODULUS if column == MODULUS and SHEAR_MODULUS in written else column
        if source not in written:
            return f"table.values.{column} of recording.yaml", str(layout.values.get(column, "")), ""
        name = blocks[index % len(blocks)][source]
        read_as = f"read in {units[source]} as {column} " if source in units else ""
        return name, str(written[source][index]), read_as

    translated = place if layout != OWN_FORM or SHEAR_MODULUS in written else None
    return replace(
        whole,
        cells=cells,
        rows=rows,
        decimal_comma=False,
        copies_allowed=layout.table.copies_allowed,
        place=translated,
        units=units,
    )


def _blocks(table: Table, layout: TableLayout) -> list[Block]:
    """Return which of the table's columns each of ours is, by the samples that stand side by side."""
    if any(name not in table.cells for name in layout.names):
        table.using(layout.names)  # which names them
    samples = layout.table.samples or ({},)
    said = {*layout.columns, *layout.values, *samples[0]}
    own = [column for column in EVERY_COLUMN[1:] if column in table.cells and column not in said]
    if said & set(MEASURED):
        own = [column for column in own if column not in MEASURED]
    if len(measured := [column for column in own if column in MEASURED]) > 1:
        raise refusal(
            table.source,
            f"has {' and '.join(measured)}",
            "name the one that was measured under `columns` of recording.yaml, or remove the others",
        )
    return [{**layout.columns, **{column: column for column in own}, **sample} for sample in samples]


def _units(source: str, blocks: Sequence[Block], layout: TableLayout) -> dict[str, str]:
    """Return the units that are stated of columns, by their names or by the layout.

    Refused are names that state another unit than the layout, or one in which no such column is read.
    """
    units: dict[str, str] = {}
    for column, name in [item for block in blocks for item in block.items() if item[0] in UNITS]:
        said = units.get(column, layout.units.get(column))
        stated = None if name == column else stated_unit(name)
        if stated is not None and stated not in UNITS[column]:
            other = [each for each in MEASURED if stated in UNITS[each]] if column in MEASURED else []
            raise refusal(
                source,
                f"states {stated}, and {column} is read in {', '.join(UNITS[column])}",
                f"map it to {' or '.join(other)} in recording.yaml" if other else "convert it, and rename it",
                column=name,
            )
        if stated is not None and said is not None and said != stated:
            of_file = f"`units.{column}` of recording.yaml is" if column in layout.units else "another is in"
            raise refusal(
                source, f"states {stated}, and {of_file} {said}", "correct one of them", column=name
            )
        if unit := stated or said:
            units[column] = unit
    return units


def of_subject(table: Table, layout: TableLayout, subject: str) -> Table:
    """Return the rows of one subject, or all of a table of one.

    Refused are rows that may be the subject's: without a name, or with one that is spelled nearly so.
    """
    if SUBJECT not in layout.columns:
        return table
    name = layout.columns[SUBJECT]
    names = table.cells[name]
    if not (names == subject).any():
        known = list(dict.fromkeys(names))
        listed = ", ".join(known[:10]) + (", ..." if len(known) > 10 else "")
        raise refusal(
            table.source,
            "has no row",
            f"write the name as in subjects.csv; it has {listed}",
            column=name,
            value=subject,
        )
    table = replace(table, problems=[])
    table.flag(name, names == "", "has no name, so it is nobody's row", "write the name in every row")
    alike = [
        other for other in dict.fromkeys(names) if other != subject and spelling(other) == spelling(subject)
    ]
    reason = f"differs from {subject} in case, zeros, blanks or signs only"
    table.flag(name, np.isin(names, alike), reason, "write one name in one way, or rename one of two persons")
    table.finish()
    chosen = np.flatnonzero(names == subject)
    cells = {column: values[chosen] for column, values in table.cells.items()}
    return replace(table, cells=cells, rows=table.rows[chosen])


def _check_units_by_row(table: Table, unused: Sequence[str], block: Block, units: Mapping[str, str]) -> None:
    """Refuse a column of units, row by row, in which no column in use is read throughout."""
    own = {column: next(iter(UNITS[column])) for column in block if column in UNITS}
    read = set((own | dict(units)).values())
    for name in unused:
        words = list(dict.fromkeys(filter(None, table.cells[name].tolist())))
        stated = {unit_in_words(word) for word in words}
        if words and None not in stated and not (len(stated) == 1 and stated <= read):
            raise refusal(
                table.source,
                "states units row by row, in which no column is read throughout",
                "write one unit in all rows, say it under `units` of recording.yaml, and drop this column",
                column=name,
                value=", ".join(words),
            )


def _understood(
    written: Mapping[str, TextArray], layout: TableLayout, units: Mapping[str, str], rows: IntArray
) -> dict[str, TextArray]:
    """Return the cells in this project's columns, units, words and numbers."""
    cells = dict(written)

    def change(column: str, by: Callable[[str], str]) -> None:
        if column in cells:
            cells[column] = column_of(map(by, cells[column]))

    for column, unit in units.items():
        change(column, _times(UNITS[column][unit]))
    change("fit_r2", _fraction)
    if SHEAR_MODULUS in cells:
        cells[MODULUS] = cells.pop(SHEAR_MODULUS)
        change(MODULUS, _times(THREE))
        if units.get(STANDARD_ERROR) in MODULUS_UNITS:
            change(STANDARD_ERROR, _times(THREE))
    change("status", lambda word: layout.table.statuses.get(word, word))
    if layout.table.first_phase:
        change(PHASE, _arithmetic(lambda number: number - layout.table.first_phase))
    # what is counted may be so within what is constant
    for column, value in sorted(layout.values.items(), key=lambda item: item[1] == COUNTED):
        is_counted = value == COUNTED
        cells[column] = _counted(cells, column, rows) if is_counted else column_of([str(value)] * len(rows))
    return cells


def _counted(cells: Mapping[str, TextArray], column: str, rows: IntArray) -> TextArray:
    """Return the numbers of phases of a repeat, or of samples of a phase and repeat, in the file's order.

    Where the samples of a phase stand side by side, the file's rows are counted.
    """
    within = {PHASE: ["repeat"], "sample": [PHASE, "repeat"]}[column]
    seen: dict[tuple[str, ...], dict[int, int]] = {}
    numbers = []
    for index, row in enumerate(rows.tolist()):
        key = tuple(str(cells[name][index]) for name in within if name in cells)
        known = seen.setdefault(key, {})
        numbers.append(known.setdefault(row if column == PHASE else index, len(known)))
    return column_of(map(str, numbers))


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
