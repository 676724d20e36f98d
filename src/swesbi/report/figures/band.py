"""Curves over the cardiac cycle: bands of what is predicted, and points of what was measured.

A gated recording has phases that many beats share, a free-running one single pushes. Both are points here.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import Band
from swesbi.report.figures.style import EXCLUDED_POSTERIOR, OBSERVED

PHASE: Final = "phase of the cardiac cycle, from the R peak"
INSTANT: Final = "instant of the push in its own beat, from the R peak"
STIFFNESS: Final = "stiffness $E = 3\\rho c_s^2$ (kPa)"
SPEED: Final = "shear-wave speed (m/s)"
HEAD_ROOM: Final = 1.08


def draw_band(
    axes: Axes, phase: FloatArray, band: Band, color: str, label: str = "", *, line: str = "-"
) -> None:
    """Draw a median within its interval at every point of the cycle, with one entry of the legend."""
    axes.plot(phase, band.median, line, color=color)
    axes.fill_between(phase, band.low, band.high, color=color, alpha=0.25, lw=0, label=label)


def draw_outer_band(axes: Axes, phase: FloatArray, band: Band, color: str, label: str = "") -> None:
    """Draw a wider interval around a band: paler, with an edge."""
    axes.fill_between(
        phase, band.low, band.high, facecolor=to_rgba(color, 0.13), edgecolor=to_rgba(color, 0.55), lw=0.5,
        label=label,
    )  # fmt: skip


def draw_new_points(axes: Axes, phase: FloatArray, band: Band, color: str, label: str = "") -> None:
    """Draw where new measurements at the same points would lie, as broad bars behind the measured ones."""
    axes.vlines(phase, band.low, band.high, color=color, lw=2.4, alpha=0.32, label=label)


def draw_points(
    axes: Axes,
    phase: FloatArray,
    value: FloatArray,
    se: FloatArray,
    label: str = "",
    *,
    color: str = OBSERVED,
) -> None:
    """Draw measured points with their standard errors; a point that was not measured is NaN and left out."""
    shown = np.isfinite(value)
    axes.errorbar(
        phase[shown],
        value[shown],
        se[shown],
        fmt="o",
        ms=2.2,
        elinewidth=0.8,
        zorder=4,
        color=color,
        label=label,
    )


def draw_missing(axes: Axes, phase: FloatArray) -> None:
    """Mark the points of a recording that were not measured."""
    for number, at in enumerate(phase):
        axes.axvline(
            at,
            color=EXCLUDED_POSTERIOR,
            lw=0.8,
            ls=":",
            label=None if number else "phase without a measurement",
        )


def cycle_axis(axes: Axes, label: str = PHASE) -> None:
    """Let x be one cardiac cycle."""
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "0.25", "0.5", "0.75", "1"])
    axes.set_xlabel(label)


def from_zero(axes: Axes, *values: FloatArray) -> None:
    """Let y begin at 0 and hold all of the values, NaN left out."""
    axes.set_ylim(0.0, HEAD_ROOM * max(float(np.nanmax(each)) for each in values if np.isfinite(each).any()))
