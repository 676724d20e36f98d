"""What a clinic measures beside the speeds: the pressures of a cuff, and how long the heart ejects.

All of it is optional: a recording says as much without, and more with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, Self

import numpy as np
from pydantic import Field, model_validator

from swesbi.artefacts import Variable
from swesbi.base.settings import Settings
from swesbi.context import SubjectVariable, check_bounds

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
