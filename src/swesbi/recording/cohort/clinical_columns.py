"""The optional columns of ``subjects.csv``, read cell by cell; a cell that is empty was not measured."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.context import SubjectVariable
from swesbi.recording.cohort.clinical import CLINICAL, CLINICAL_BOUNDS, ClinicalRow
from swesbi.recording.tables.table import MISSING, Table

BOTH: Final = "give both pressures of the cuff, or leave both empty"
MS_PER_MINUTE: Final = 6e4
UNITS: Final = "mmhg|kpa|ms|msec|s|sec"


def clinical_rows(table: Table, hr_bpm: FloatArray) -> list[ClinicalRow | None]:
    """Return what was measured of each subject beside the speeds; None where a cell is wrong.

    Problems are noted in the table, which may have any of the columns, or none.

    Args:
        table: ``subjects.csv`` with n rows.
        hr_bpm: Heart rates, NaN where wrong; shape (n,). No ejection is longer than the beat.
    """
    table.refuse_lookalikes(
        {each.name: f"call it {each.name}, in {each.unit}" for each in CLINICAL}, _resembles
    )
    values = {each.name: _values(table, each) for each in CLINICAL}
    given = {name: _given(table, name) for name in values}
    wrong = np.logical_or.reduce([given[name] & _outside(values[name], name) for name in values])
    wrong |= _wrong_pair(table, values, given) | _endless(table, values["lvet_ms"], hr_bpm)
    rows = [
        {name: float(own[index]) for name, own in values.items() if given[name][index]}
        for index in range(len(table.rows))
    ]
    return [None if bad else ClinicalRow.from_plain(row) for bad, row in zip(wrong, rows, strict=True)]


def _values(table: Table, variable: SubjectVariable) -> FloatArray:
    """Return the numbers of a column; NaN where there is none."""
    if variable.name not in table.cells:
        return np.full(len(table.rows), np.nan)
    low, high = CLINICAL_BOUNDS[variable.name]
    remedy = f"{variable.remedy}, or leave it empty"
    return table.number(variable.name, low, high, remedy, may_be_empty=True)


def _given(table: Table, name: str) -> BoolArray:
    empty = np.isin(table.cells[name], MISSING) if name in table.cells else True
    return np.broadcast_to(~np.asarray(empty, dtype=np.bool_), len(table.rows))


def _outside(values: FloatArray, name: str) -> BoolArray:
    low, high = CLINICAL_BOUNDS[name]
    return ~((values >= low) & (values <= high))


def _wrong_pair(table: Table, values: dict[str, FloatArray], given: dict[str, BoolArray]) -> BoolArray:
    """Refuse one pressure without the other, and a diastolic one that is not the lower."""
    alone = given["sbp_mmhg"] & ~given["dbp_mmhg"]
    table.flag("sbp_mmhg", alone, "is given without dbp_mmhg", BOTH)
    other = given["dbp_mmhg"] & ~given["sbp_mmhg"]
    table.flag("dbp_mmhg", other, "is given without sbp_mmhg", BOTH)
    swapped: BoolArray = values["dbp_mmhg"] >= values["sbp_mmhg"]
    reason = "is not below sbp_mmhg of the same row"
    table.flag("dbp_mmhg", swapped, reason, "correct the cells (swapped?), or leave both empty")
    return alone | other | swapped


def _endless(table: Table, lvet_ms: FloatArray, hr_bpm: FloatArray) -> BoolArray:
    """Refuse an ejection that is as long as the beat."""
    endless: BoolArray = lvet_ms * hr_bpm >= MS_PER_MINUTE
    reason = "is no shorter than a beat at hr_bpm of the same row"
    table.flag("lvet_ms", endless, reason, "correct the cell that is wrong, or leave it empty")
    return endless


def _resembles(lowered: str, name: str) -> bool:
    """Tell whether a name is the variable's in capitals, or with another unit or none."""
    return re.fullmatch(rf"{name.partition('_')[0]}[\W_]*({UNITS})?[\W_]*", lowered) is not None
