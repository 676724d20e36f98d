"""What is computed of draws from a distribution: intervals, effective number of weighted ones, resampling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray


def interval_levels(mass: float) -> FloatArray:
    """Return the two quantile levels that enclose the equal-tailed interval of this mass."""
    return np.array([0.5 - 0.5 * mass, 0.5 + 0.5 * mass])


def median_and_interval(draws: FloatArray, mass: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lower end, median and upper end of draws along their first axis; shape of one draw each."""
    low, high = interval_levels(mass)
    low_end, median, high_end = np.quantile(draws, [low, 0.5, high], axis=0)
    return low_end, median, high_end


def equal_weights(draws: int) -> FloatArray:
    """Return weights 1/n of shape (n,)."""
    return np.full(draws, 1.0 / draws)


def normalised(log_weight: FloatArray) -> FloatArray:
    """Return weights that add up to one; shape (n,)."""
    return np.asarray(np.exp(log_weight - logsumexp(log_weight)))


def effective_draws(weight: FloatArray) -> float:
    """Return the effective number of draws, 1 / sum w^2, of normalised weights (n,) (Kish 1965)."""
    return float(1.0 / (weight**2).sum())


def resampled_rows(weight: FloatArray, draws: int, rng: np.random.Generator) -> NDArray[np.int_]:
    """Return the rows of equally weighted draws, (draws,), by systematic resampling (Kitagawa 1996).

    Each row is taken as often as its weight (n,), known up to a factor, says, rounded up or down.
    """
    levels = (np.arange(draws) + rng.random()) / draws
    edges = np.cumsum(weight)
    return np.searchsorted(edges / edges[-1], levels, side="right")
