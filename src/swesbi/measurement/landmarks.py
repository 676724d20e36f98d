"""Landmarks of a curve: its peak, and where it crosses a level before and after it; in two variants.

The paper's text names what the scalars capture, not how they are taken. ``paper`` reads single values: the
largest one, and the crossings next to it. On a recording of some twenty phases one noisy phase then moves
the peak by several phases, and what is counted from it. ``robust`` fits a parabola to all of the largest
values and takes the outermost crossings, which one phase moves by about the distance to its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.measurement.settings import Landmarks

LARGEST: Final = 1.0 / 3.0
"""Share of the way from baseline to largest value above which a value is one of the largest. Chosen: some
seven of twenty phases; one that is off by a tenth then moves the vertex by about a phase at most."""


@dataclass(frozen=True)
class Peak:
    """The peak of n curves: height, the grid point at or next to it, and the phase; each of shape (n,)."""

    index: IntArray
    phase: FloatArray
    height: FloatArray


FindPeak = Callable[[FloatArray, FloatArray, FloatArray], Peak]
FindCrossing = Callable[[FloatArray, FloatArray, Peak, FloatArray], FloatArray]


@dataclass(frozen=True)
class LandmarkRules:
    """How landmarks of curves (n, G) on a grid (G,) are found: peaks, rise and fall through levels."""

    peak: FindPeak
    before: FindCrossing
    after: FindCrossing


def find_peak(grid: FloatArray, curves: FloatArray) -> Peak:
    """Find the largest grid value, and its phase by the parabola through it and its two neighbours.

    The vertex moves continuously where the largest value passes from one grid point to the next; the
    parabola's height would jump there, the largest value itself does not. At an end of the uniform grid (G,)
    the phase is that of the grid point.
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


def _interpolate(grid: FloatArray, curves: FloatArray, level: FloatArray, start: IntArray) -> FloatArray:
    rows = np.arange(len(curves))
    before, after = curves[rows, start], curves[rows, start + 1]
    change = np.where(after == before, 1.0, after - before)
    fraction = np.clip((level - before) / change, 0.0, 1.0)
    return np.asarray(grid[start] + fraction * (grid[1] - grid[0]))


def fitted_peak(grid: FloatArray, curves: FloatArray, baseline: FloatArray) -> Peak:
    """Find the vertex of the parabola of least squares through the largest values.

    A value's weight is by how much it exceeds the level of ``LARGEST``, so that none enters or leaves with a
    jump. The vertex stays among the largest values; where these do not bend down, the phase is their weighted
    mean and the height the largest value.
    """
    single = find_peak(grid, curves)
    level = baseline + LARGEST * (single.height - baseline)
    weight = np.maximum(curves - level[:, None], 0.0)
    total = weight.sum(axis=1)
    fitted = total > 0.0
    weight = np.where(fitted[:, None], weight, 1.0) / np.where(fitted, total, len(grid))[:, None]
    centre = weight @ grid
    phase, height = _vertex(grid[None] - centre[:, None], curves, weight, single.height)
    phase = np.where(fitted, centre + phase, single.phase)
    index = np.rint((phase - grid[0]) / (grid[1] - grid[0])).astype(np.int64)
    return Peak(index, phase, np.where(fitted, height, single.height))


def _vertex(
    offset: FloatArray, curves: FloatArray, weight: FloatArray, largest: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return offset and height of the vertices of weighted parabolas; all of shape (n, G), results (n,)."""
    m2, m3, m4 = (np.sum(weight * offset**power, axis=1) for power in (2, 3, 4))
    mean = np.sum(weight * curves, axis=1)
    first = np.sum(weight * offset * curves, axis=1)
    second = np.sum(weight * offset**2 * (curves - mean[:, None]), axis=1)
    # normal equations of mean + slope x + bend (x^2 - m2), x being weighted about its own mean
    determinant = m2 * (m4 - m2**2) - m3**2
    usable = determinant > 0.0
    safe = np.where(usable, determinant, 1.0)
    slope = ((m4 - m2**2) * first - m3 * second) / safe
    bend = (m2 * second - m3 * first) / safe
    down = usable & (bend < 0.0)
    free = np.where(down, -0.5 * slope / np.where(down, bend, -1.0), 0.0)
    used = weight > 0.0
    low = np.min(np.where(used, offset, np.inf), axis=1)
    high = np.max(np.where(used, offset, -np.inf), axis=1)
    at = np.clip(free, low, high)
    return at, np.where(down, mean - bend * m2 + slope * at + bend * at**2, largest)


def outermost_crossing_before(
    grid: FloatArray, curves: FloatArray, peak: Peak, level: FloatArray
) -> FloatArray:
    """Return the phase at which each curve first reaches its level, the peak's at the latest; shape (n,)."""
    above = curves >= level[:, None]
    first = np.argmax(above, axis=1)
    crossed = _interpolate(grid, curves, level, np.maximum(first - 1, 0))
    reached = np.where(first > 0, np.minimum(crossed, peak.phase), grid[0])
    return np.where(above.any(axis=1), reached, peak.phase)


def outermost_crossing_after(
    grid: FloatArray, curves: FloatArray, peak: Peak, level: FloatArray
) -> FloatArray:
    """Return the phase at which each curve leaves its level for good, not before the peak's; shape (n,)."""
    above = curves >= level[:, None]
    last = len(grid) - 1 - np.argmax(above[:, ::-1], axis=1)
    crossed = _interpolate(grid, curves, level, np.minimum(last, len(grid) - 2))
    left = np.where(last < len(grid) - 1, np.maximum(crossed, peak.phase), grid[-1])
    return np.where(above.any(axis=1), left, peak.phase)


LANDMARKS: Final[Mapping[Landmarks, LandmarkRules]] = {
    "paper": LandmarkRules(
        lambda grid, curves, baseline: find_peak(grid, curves), last_crossing_before, first_crossing_after
    ),
    "robust": LandmarkRules(fitted_peak, outermost_crossing_before, outermost_crossing_after),
}
