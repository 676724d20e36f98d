"""What is computed of draws from a distribution: intervals, effective number of weighted ones, resampling."""

from __future__ import annotations

from typing import Final

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


CELLS: Final = 8  # of draws, a width of the kernel
REACH: Final = 6.0  # widths, beyond which a normal kernel is nothing


def kernel_density(draws: FloatArray, at: FloatArray, width: float | None = None) -> FloatArray:
    """Return the density of draws (n,) by normal kernels at points (m,), in ascending order; shape (m,).

    Without a width it is that of Scott (Multivariate Density Estimation, 1992), sd n^(-1/5). Draws are first
    shared among the two nearest of evenly spaced cells, which widens a kernel by a thousandth (Jones and
    Lotwick 1984, Appl Stat 33:120).
    """
    sd = width or float(draws.std(ddof=1)) * len(draws) ** -0.2
    low, high = float(at[0]) - REACH * sd, float(at[-1]) + REACH * sd
    near = draws[(draws >= low) & (draws <= high)]
    cells: FloatArray = near
    share: FloatArray = np.ones(len(near))
    if (count := int(CELLS * (high - low) / sd)) < len(near):
        cells = np.linspace(low, high, count)
        place = (near - low) / (cells[1] - low)
        below = np.minimum(place.astype(np.int64), count - 2)
        above = place - below
        share = np.asarray(
            np.bincount(below, 1.0 - above, count) + np.bincount(below + 1, above, count), np.float64
        )
    z = (at[:, None] - cells) / sd
    return np.asarray(np.exp(-0.5 * z**2) @ share / (len(draws) * sd * np.sqrt(2.0 * np.pi)))


def resampled_rows(weight: FloatArray, draws: int, rng: np.random.Generator) -> NDArray[np.int_]:
    """Return the rows of equally weighted draws, (draws,), by systematic resampling (Kitagawa 1996).

    Each row is taken as often as its weight (n,), known up to a factor, says, rounded up or down.
    """
    levels = (np.arange(draws) + rng.random()) / draws
    edges = np.cumsum(weight)
    return np.searchsorted(edges / edges[-1], levels, side="right")
