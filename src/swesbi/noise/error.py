"""The standard error of the mean speed at a phase, from the cohort's components and its own counts."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Components(Protocol):
    """Anything with two relative standard deviations: of a cohort or of one recording."""

    @property
    def repeat_fraction(self) -> float:
        """Relative standard deviation between repeats."""

    @property
    def sample_fraction(self) -> float:
        """Relative standard deviation between samples of a repeat."""


def relative_se(samples_by_repeat: NDArray[np.int64], noise: Components) -> FloatArray:
    """Return the standard error of each phase's mean speed as a fraction of it; shape (p,).

    The mean is over repeat means, so with R repeats of n_r accepted samples it is
    sqrt(sum_r (s_rep^2 + s_sam^2 / n_r)) / R; repeats without an accepted sample do not count.

    Args:
        samples_by_repeat: Accepted samples of each repeat; shape (p, repeats).
        noise: The components.

    Returns:
        NaN at phases without an accepted sample.
    """
    counted = samples_by_repeat > 0
    per_repeat = noise.repeat_fraction**2 + noise.sample_fraction**2 / np.maximum(samples_by_repeat, 1)
    repeats = counted.sum(axis=1)
    variance = np.where(counted, per_repeat, 0.0).sum(axis=1)
    return np.where(repeats > 0, np.sqrt(variance) / np.maximum(repeats, 1), np.nan)
