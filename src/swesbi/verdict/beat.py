"""What the posterior's beats do beside what was measured of the heart, and what nobody fitted.

How far the two may lie apart the prior does not say, so they have no null distribution: their distance is
counted in standard deviations of the posterior, of the measurement, and of the model. Of a heart that the
model describes, that distance is normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.verdict.verdict import VerdictTest

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Predicted:
    """One quantity of the beat, all in its own unit.

    Attributes:
        values: Of each posterior draw; shape (n,).
        model_sd: How far the model may be wrong in it.
        measured: What was measured.
        measurement_sd: Standard deviation of that measurement.
    """

    values: FloatArray
    model_sd: float
    measured: float
    measurement_sd: float

    @property
    def sd(self) -> float:
        """Standard deviation of posterior, model and measurement together."""
        return float(np.sqrt(self.values.var() + self.model_sd**2 + self.measurement_sd**2))

    @property
    def z(self) -> float:
        """Median of the prediction less what was measured, over their standard deviation."""
        return float((np.median(self.values) - self.measured) / self.sd)

    def test(self, name: str, short: str, unit: str, limit: float) -> VerdictTest:
        """Return the test that is flagged where the two lie more than ``limit`` standard deviations apart."""
        low, middle, high = np.quantile(self.values, (0.05, 0.5, 0.95))
        return VerdictTest(
            name=name,
            statistic=self.z,
            p_value=None,
            threshold=limit,
            flagged=abs(self.z) > limit,
            detail=f"{short} {middle:.0f} {unit} predicted [{low:.0f}, {high:.0f}], {self.measured:.0f} "
            f"{unit} measured, {limit * self.sd:.0f} {unit} tolerated (z = {self.z:.2f})",
        )
