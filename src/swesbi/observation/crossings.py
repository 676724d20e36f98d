"""Where curves reach their peak and cross levels, to a fraction of a grid step and for all curves at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Peak:
    """The peak of n curves: largest grid value, its index, and the refined phase; each of shape (n,)."""

    index: NDArray[np.int64]
    phase: FloatArray
    height: FloatArray


def find_peak(grid: FloatArray, curves: FloatArray) -> Peak:
    """Find the largest grid value, and its phase by the parabola through it and its two neighbours.

    The vertex moves continuously where the largest value passes from one grid point to the next; the
    parabola's height would jump there, the largest value itself does not. At an end of the grid the
    phase is that of the grid point.

    Args:
        grid: Uniform phases; shape (G,).
        curves: Values; shape (n, G).
    """
    rows = np.arange(len(curves))
    index = np.argmax(curves, axis=1)
    inner = np.clip(index, 1, len(grid) - 2)
    left, middle, right = (curves[rows, inner + shift] for shift in (-1, 0, 1))
    curvature = left - 2.0 * middle + right
    refined = (index == inner) & (curvature < 0.0)
    offset = np.where(refined, 0.5 * (left - right) / np.where(refined, curvature, 1.0), 0.0)
    return Peak(index, grid[index] + offset * (grid[1] - grid[0]), curves[rows, index])


def last_crossing_before(grid: FloatArray, curves: FloatArray, peak: Peak, level: FloatArray) -> FloatArray:
    """Return the phase at which each curve last rises through its level before the peak; shape (n,).

    Crossings are interpolated linearly. A level that the curve already exceeds at the start of the cycle
    is crossed at the start, 0, towards which the crossing moves as the level sinks.
    """
    below = (curves < level[:, None]) & (np.arange(len(grid)) <= peak.index[:, None])
    last = len(grid) - 1 - np.argmax(below[:, ::-1], axis=1)
    crossed = _interpolate(grid, curves, level, np.minimum(last, len(grid) - 2))
    return np.where(below.any(axis=1), np.minimum(crossed, peak.phase), grid[0])


def first_crossing_after(grid: FloatArray, curves: FloatArray, peak: Peak, level: FloatArray) -> FloatArray:
    """Return the phase at which each curve first falls through its level after the peak; shape (n,).

    Crossings are interpolated linearly. A level that is never crossed gives the end of the cycle, 1,
    towards which the crossing moves as the level sinks.
    """
    below = (curves < level[:, None]) & (np.arange(len(grid)) > peak.index[:, None])
    first = np.argmax(below, axis=1)
    crossed = _interpolate(grid, curves, level, np.maximum(first - 1, 0))
    return np.where(below.any(axis=1), np.maximum(crossed, peak.phase), grid[-1])


def _interpolate(
    grid: FloatArray, curves: FloatArray, level: FloatArray, start: NDArray[np.int64]
) -> FloatArray:
    rows = np.arange(len(curves))
    before, after = curves[rows, start], curves[rows, start + 1]
    change = np.where(after == before, 1.0, after - before)
    fraction = np.clip((level - before) / change, 0.0, 1.0)
    return np.asarray(grid[start] + fraction * (grid[1] - grid[0]))
