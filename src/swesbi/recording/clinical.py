"""What a clinic measures beside the speeds: the pressures of a cuff, and how long the heart ejects.

All of it is optional: a recording says as much without, and more with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

from pydantic import Field

from swesbi.artefacts import Variable
from swesbi.base import Settings


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


class ClinicalErrors(Settings):
    """How far such measures lie from what the model calls by their name: normal errors."""

    sbp_bias_mmhg: float = Field(description="mean of the cuff's systolic pressure less that in the aorta")
    sbp_sd_mmhg: float = Field(gt=0.0, description="standard deviation of that difference")
    dbp_bias_mmhg: float = Field(description="mean of the cuff's diastolic pressure less that in the aorta")
    dbp_sd_mmhg: float = Field(gt=0.0, description="standard deviation of that difference")
    lvet_sd_ms: float = Field(gt=0.0, description="standard deviation of a measured ejection time")
