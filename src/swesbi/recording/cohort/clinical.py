"""What a clinic measures beside the speeds: the pressures of a cuff, and how long the heart ejects.

All of it is optional: a recording says as much without, and more with it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Final, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from swesbi.artefacts import Variable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.settings import Settings
from swesbi.context import SubjectVariable, check_bounds
from swesbi.recording.tables.table import MISSING, Table

# From shock to the crises of hypertension; from the fastest heart to the slowest (Weissler et al. 1968).
CLINICAL: Final = (
    SubjectVariable(
        "sbp_mmhg", "mmHg", "systolic pressure", "SBP",
        "systolic pressure of a cuff on the upper arm in mmHg, with dbp_mmhg", "118", "mmHg, not kPa",
        bounds=(60.0, 260.0),
    ),
    SubjectVariable(
        "dbp_mmhg", "mmHg", "diastolic pressure", "DBP", "its diastolic pressure in mmHg", "74",
        "mmHg, not kPa", bounds=(30.0, 160.0),
    ),
    SubjectVariable(
        "lvet_ms", "ms", "ejection time", "LVET",
        "left ventricular ejection time in ms, from opening to closing of the aortic valve", "295",
        "ms, not s", bounds=(100.0, 500.0),
    ),
)  # fmt: skip
"""What may be measured, in the order of its columns."""
CLINICAL_NAMES: Final = tuple(variable.name for variable in CLINICAL)
CLINICAL_BOUNDS: Final = {variable.name: variable.bounds for variable in CLINICAL if variable.bounds}
BOTH: Final = "give both pressures of the cuff, or leave both empty"
MS_PER_MINUTE: Final = 6e4
UNIT_WORDS: Final = "mmhg|kpa|ms|msec|s|sec"


@dataclass(frozen=True)
class ClinicalMeasures:
    """Measures of one subject, NaN where one was not taken."""

    sbp_mmhg: Annotated[
        float, Variable("", "mmHg", "systolic pressure by a cuff on the upper arm; NaN without")
    ] = math.nan
    dbp_mmhg: Annotated[float, Variable("", "mmHg", "diastolic pressure likewise")] = math.nan
    lvet_ms: Annotated[float, Variable("", "ms", "ejection time of the left ventricle; NaN without")] = (
        math.nan
    )

    def same_as(self, other: ClinicalMeasures) -> bool:
        """Tell whether both hold the same values; what was taken of neither is the same."""
        mine, its = (np.array(list(vars(one).values())) for one in (self, other))
        return np.array_equal(mine, its, equal_nan=True)

    @property
    def has_pressures(self) -> bool:
        """Whether both pressures of the cuff were taken."""
        return math.isfinite(self.sbp_mmhg) and math.isfinite(self.dbp_mmhg)

    @property
    def has_ejection_time(self) -> bool:
        """Whether the ejection time was taken."""
        return math.isfinite(self.lvet_ms)


NOT_MEASURED: Final = ClinicalMeasures()
"""Of a subject without any of them."""


class ClinicalRow(Settings):
    """The optional part of a row of ``subjects.csv``: the plain twin of :class:`ClinicalMeasures`."""

    sbp_mmhg: float | None = None
    dbp_mmhg: float | None = None
    lvet_ms: float | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_bounds(self.model_dump(), CLINICAL_BOUNDS)
        if (self.sbp_mmhg is None) != (self.dbp_mmhg is None):
            raise ValueError("sbp_mmhg and dbp_mmhg are given together, or not at all")
        if self.sbp_mmhg is not None and self.dbp_mmhg is not None and self.dbp_mmhg >= self.sbp_mmhg:
            raise ValueError(f"dbp_mmhg = {self.dbp_mmhg:g} must be below sbp_mmhg = {self.sbp_mmhg:g}")
        return self

    def to_measures(self) -> ClinicalMeasures:
        """Return the same values, NaN for what is not there."""
        known = {name: value for name, value in self.model_dump().items() if value is not None}
        return ClinicalMeasures(**known)


def clinical_rows(table: Table, hr_bpm: FloatArray) -> list[ClinicalRow | None]:
    """Return what was measured of each subject beside the speeds; None where a cell is wrong.

    Problems are noted in the table, ``subjects.csv``, which may have any of the columns, or none. Heart
    rates, shape (n,), are NaN where wrong: no ejection is longer than the beat.
    """
    table.refuse_lookalikes(
        {each.name: f"call it {each.name}, in {each.unit}" for each in CLINICAL}, _resembles
    )
    table = table.with_empty([each.name for each in CLINICAL])
    values = {
        each.name: table.number(
            each.name, *CLINICAL_BOUNDS[each.name], f"{each.remedy}, or leave it empty", may_be_empty=True
        )
        for each in CLINICAL
    }
    given = {name: ~np.isin(table.cells[name], MISSING) for name in values}
    _check_pressures(table, values, given)
    endless = values["lvet_ms"] * hr_bpm >= MS_PER_MINUTE
    reason = "is no shorter than a beat at hr_bpm of the same row"
    table.flag("lvet_ms", endless, reason, "correct the cell that is wrong, or leave it empty")
    rows = [
        {name: float(own[index]) for name, own in values.items() if given[name][index]}
        for index in range(len(table.rows))
    ]
    return [None if bad else _row(row) for bad, row in zip(endless, rows, strict=True)]


def _check_pressures(table: Table, values: dict[str, FloatArray], given: dict[str, BoolArray]) -> None:
    """Refuse one pressure without the other, and a diastolic one that is not the lower."""
    for name, other in (("sbp_mmhg", "dbp_mmhg"), ("dbp_mmhg", "sbp_mmhg")):
        table.flag(name, given[name] & ~given[other], f"is given without {other}", BOTH)
    swapped = values["dbp_mmhg"] >= values["sbp_mmhg"]
    reason = "is not below sbp_mmhg of the same row"
    table.flag("dbp_mmhg", swapped, reason, "correct the cells (swapped?), or leave both empty")


def _row(measured: dict[str, float]) -> ClinicalRow | None:
    """Return what was measured of a subject; None of what the table's cells were refused for."""
    try:
        return ClinicalRow.from_plain(measured)
    except ValidationError:
        return None


def _resembles(lowered: str, name: str) -> bool:
    """Tell whether a name is the variable's in capitals, or with another unit or none."""
    return re.fullmatch(rf"{name.partition('_')[0]}[\W_]*({UNIT_WORDS})?[\W_]*", lowered) is not None


class ClinicalErrors(Settings):
    """How far such measures lie from what the model calls by their name: normal errors.

    Cuff less intra-aortic pressure, 74 studies of 3,073 people: Picone et al., J Am Coll Cardiol
    2017;70:572.
    """

    sbp_bias_mmhg: float = Field(
        description="Mean of the cuff's systolic pressure less that in the aorta. Picone 2017."
    )
    sbp_sd_mmhg: float = Field(
        gt=0.0,
        description="Standard deviation of that difference. The mean absolute difference of 8.0 makes "
        "this if it is normal (Picone 2017).",
    )
    dbp_bias_mmhg: float = Field(
        description="Mean of the cuff's diastolic pressure less that in the aorta. It is 5.5 above the "
        "brachial artery's, which is 1.0 below the aorta's (Picone 2017)."
    )
    dbp_sd_mmhg: float = Field(
        gt=0.0,
        description="Standard deviation of that difference. Chosen: the largest that the standard for "
        "cuffs admits (ISO 81060-2).",
    )
    lvet_sd_ms: float = Field(
        gt=0.0,
        description="Standard deviation of a measured ejection time. LVET of healthy adults at a given "
        "heart rate has about 10 ms (Weissler et al., Circulation 1968;37:149). That bounds the error of "
        "its measurement; chosen.",
    )
