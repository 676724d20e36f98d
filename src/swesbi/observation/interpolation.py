"""Periodic interpolation: a simulated cycle at a recording's phases, and phases on the analysis grid."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

FloatArray = NDArray[np.float64]
WRAP = 2  # neighbours on either side that the slope of a PCHIP node depends on, through the seam
CHUNK = 2048  # rows; keeps the interpolant's coefficients within the processor's cache


def analysis_grid(grid_points: int) -> FloatArray:
    """Return the uniform grid of ``grid_points`` phases on [0, 1], both ends included."""
    return np.linspace(0.0, 1.0, grid_points)


def sample_cycle(cycle_phase: FloatArray, curves: FloatArray, phase: FloatArray) -> FloatArray:
    """Evaluate simulated cycles at a recording's phases by a periodic cubic spline.

    Args:
        cycle_phase: Phases of the simulated cycle in [0, 1), ascending; shape (M,).
        curves: One or several cycles; shape (..., M).
        phase: Where to evaluate; shape (P,).

    Returns:
        The values at ``phase``; shape (..., P). A cycle that holds NaN gives NaN.
    """
    weights = _spline_weights(cycle_phase.tobytes(), phase.tobytes())
    return np.asarray(np.einsum("...m,pm->...p", curves, weights, optimize=False))


def slope_cycle(cycle_phase: FloatArray, curves: FloatArray, phase: FloatArray) -> FloatArray:
    """Differentiate simulated cycles at a recording's phases, by the spline of :func:`sample_cycle`.

    Returns:
        d curve / d phase, per cycle, of shape (..., P) for curves (..., M).
    """
    weights = _spline_weights(cycle_phase.tobytes(), phase.tobytes(), 1)
    return np.asarray(np.einsum("...m,pm->...p", curves, weights, optimize=False))


def to_grid(phase: FloatArray, values: FloatArray, grid_points: int) -> FloatArray:
    """Interpolate values at some phases onto the analysis grid by periodic, monotone PCHIP.

    The interpolant (Fritsch and Butland 1984) goes through every value, does not overshoot and
    closes around the cycle. Observed and simulated curves pass this same function.

    Args:
        phase: Phases in [0, 1), strictly ascending; shape (p,), p >= 3.
        values: One or several curves at these phases; shape (..., p).
        grid_points: Number G of grid points.

    Returns:
        Curves on ``analysis_grid(grid_points)``; shape (..., G); the first value equals the last.

    Raises:
        ValueError: Fewer than three phases, or phases that are not ascending within [0, 1).
    """
    _check_phases(phase)
    knots = np.concatenate([phase[-WRAP:] - 1.0, phase, phase[:WRAP] + 1.0])
    rows = values.reshape(-1, len(phase))
    curves = np.empty((len(rows), grid_points))
    grid = analysis_grid(grid_points)
    for start in range(0, len(rows), CHUNK):
        part = rows[start : start + CHUNK]
        wrapped = np.concatenate([part[:, -WRAP:], part, part[:, :WRAP]], axis=1)
        curves[start : start + CHUNK] = PchipInterpolator(knots, wrapped, axis=1)(grid)
    curves[:, -1] = curves[:, 0]
    return curves.reshape(*values.shape[:-1], grid_points)


@lru_cache(maxsize=256)
def _spline_weights(cycle_phase: bytes, phase: bytes, derivative: int = 0) -> FloatArray:
    # The spline is linear in the values: its cardinal functions, once, serve every curve.
    nodes, at = np.frombuffer(cycle_phase), np.frombuffer(phase)
    closed = np.append(nodes, nodes[0] + 1.0)
    cardinal = np.vstack([np.eye(len(nodes)), np.eye(len(nodes))[:1]])
    wrapped = nodes[0] + (at - nodes[0]) % 1.0
    spline = CubicSpline(closed, cardinal, bc_type="periodic")
    weights: FloatArray = np.ascontiguousarray(spline(wrapped, derivative))
    weights.flags.writeable = False
    return weights


def _check_phases(phase: FloatArray) -> None:
    if len(phase) < 3:
        raise ValueError(f"interpolation around the cycle needs at least 3 measured phases, got {len(phase)}")
    if phase[0] < 0.0 or phase[-1] >= 1.0 or np.any(np.diff(phase) <= 0.0):
        raise ValueError(
            f"phases must ascend strictly within [0, 1), got {np.array2string(phase, precision=4)}"
        )
