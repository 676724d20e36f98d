"""Equal-tailed intervals of draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def interval_levels(mass: float) -> FloatArray:
    """Return the two quantile levels that enclose the equal-tailed interval of this mass."""
    return np.array([0.5 - 0.5 * mass, 0.5 + 0.5 * mass])


def median_and_interval(draws: FloatArray, mass: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lower end, median and upper end of draws along their first axis; shape of one draw each."""
    low, high = interval_levels(mass)
    low_end, median, high_end = np.quantile(draws, [low, 0.5, high], axis=0)
    return low_end, median, high_end
