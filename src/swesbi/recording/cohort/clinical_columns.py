"""The optional columns of ``subjects.csv``, read cell by cell; a cell that is empty was not measured."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.recording.cohort.clinical import CLINICAL, ClinicalRow, ClinicalVariable
from swesbi.recording.tables.table import MISSING, Table

BOTH: Final = "give both pressures of the cuff, or leave both empty"
MS_PER_MINUTE: Final = 6e4


@dataclass(frozen=True)
class _Column:
    """One column of n rows: its values, NaN where there is none; which cells are filled; which wrong."""

    values: FloatArray
    given: BoolArray
    wrong: BoolArray


def clinical_rows(table: Table, hr_bpm: FloatArray) -> list[ClinicalRow | None]:
    """Return what was measured of each subject beside the speeds; None where a cell is wrong.

    Problems are noted in the table, which may have any of the columns, or none.

    Args:
        table: ``subjects.csv`` with n rows.
        hr_bpm: Heart rates, NaN where wrong; shape (n,). No ejection is longer than the beat.
    """
    remedies = {each.name: f"call it {each.name}, in {each.unit}" for each in CLINICAL}
    table.refuse_lookalikes(remedies, _resembles)
    columns = {each.name: _column(table, each) for each in CLINICAL}
    wrong = np.logical_or.reduce([column.wrong for column in columns.values()])
    wrong |= _wrong_pressures(table, columns["sbp_mmhg"], columns["dbp_mmhg"])
    wrong |= _wrong_ejection(table, columns["lvet_ms"], hr_bpm)
    given = [
        {name: float(column.values[index]) for name, column in columns.items() if column.given[index]}
        for index in range(len(wrong))
    ]
    return [None if bad else ClinicalRow.from_plain(row) for bad, row in zip(wrong, given, strict=True)]


def _column(table: Table, variable: ClinicalVariable) -> _Column:
    """Read a column, all of it empty where there is none; what has another unit is told so."""
    if variable.name not in table.cells:
        nothing = np.zeros(len(table.rows), dtype=np.bool_)
        return _Column(np.full(len(table.rows), np.nan), nothing, nothing)
    low, high = variable.declared
    values = table.number(variable.name, -np.inf, np.inf, "", may_be_empty=True)
    given = ~np.isin(table.cells[variable.name], MISSING)
    outside = (values < low) | (values > high)
    converted = values * variable.factor
    mistaken = outside & (converted >= low) & (converted <= high)
    reason = f"is outside [{low:g}, {high:g}]"
    table.flag(variable.name, mistaken, reason, f"give {variable.unit}, not {variable.mistaken}")
    remedy = f"correct the cell (units? the column is in {variable.unit}), or leave it empty"
    table.flag(variable.name, outside & ~mistaken, reason, remedy)
    return _Column(values, given, outside | (given & np.isnan(values)))


def _wrong_pressures(table: Table, systolic: _Column, diastolic: _Column) -> BoolArray:
    """Refuse one pressure without the other, and a diastolic one that is not the lower."""
    alone = systolic.given & ~diastolic.given
    table.flag("sbp_mmhg", alone, "is given without dbp_mmhg", BOTH)
    other = diastolic.given & ~systolic.given
    table.flag("dbp_mmhg", other, "is given without sbp_mmhg", BOTH)
    swapped: BoolArray = diastolic.values >= systolic.values
    reason = "is not below sbp_mmhg of the same row"
    table.flag("dbp_mmhg", swapped, reason, "correct the cells (swapped?), or leave both empty")
    return alone | other | swapped


def _wrong_ejection(table: Table, ejection: _Column, hr_bpm: FloatArray) -> BoolArray:
    """Refuse an ejection that is as long as the beat."""
    endless: BoolArray = ejection.values * hr_bpm >= MS_PER_MINUTE
    reason = "is no shorter than a beat at hr_bpm of the same row"
    table.flag("lvet_ms", endless, reason, "correct the cell that is wrong, or leave it empty")
    return endless


def _resembles(lowered: str, name: str) -> bool:
    """Tell whether a name is the variable's in capitals, or with another unit or none."""
    variable = next(each for each in CLINICAL if each.name == name)
    units = "|".join((variable.unit.lower(), variable.mistaken.lower(), "msec", "sec"))
    return re.fullmatch(rf"{variable.short}[\W_]*({units})?[\W_]*", lowered) is not None
