"""The phases of a recording: where each lies in the cycle, and periodic interpolation between them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.problems import refusal
from swesbi.recording.samples import Samples

if TYPE_CHECKING:  # a third of a second to import
    from scipy.interpolate import CubicSpline

LATEST_BEAT_PHASE = 1.1
# Between one step from phase to phase, where nothing is missing, and the two that one missing phase leaves.
STEPS_OF_A_GAP = 1.5
WRAP = 2  # neighbours on either side that the slope of a PCHIP node depends on, through the seam
CHUNK = 2048  # rows; keeps the interpolant's coefficients within the processor's cache


def nominal_phases(phases: int) -> FloatArray:
    """Return the phases of a protocol, the centres of equal parts of the cycle; shape (phases,)."""
    return np.asarray((np.arange(phases) + 0.5) / phases)


def cells_of(phase: FloatArray, cells: int) -> IntArray:
    """Return in which of so many equal parts of the cycle each phase lies; shape (p,)."""
    return np.minimum((phase * cells).astype(np.int64), cells - 1)


def locate_phases(samples: Samples, measured_phase: FloatArray, beats: BoolArray) -> FloatArray:
    """Return the phase of every gated acquisition as a fraction of the cycle, shape (P,), in [0, 1).

    A measured phase keeps the mean over its accepted repeats, (P,), NaN where none. A phase whose attempts
    all failed still has rows, and lies at their mean trigger delay / RR over regular ``beats`` (N,). A phase
    without rows lies between its neighbours, in proportion to the phase index; then the indices must follow
    the cycle.
    """
    attempted = _mean_by_phase(samples, beats, len(measured_phase))
    phase = np.where(np.isnan(measured_phase), attempted, measured_phase)
    _check_beats(phase, samples.source)
    if np.isnan(phase).any():
        _check_absent(phase, samples)
    wrapped = _between_neighbours(phase) % 1.0
    _check_distinct(wrapped, samples.source)
    return wrapped


def _mean_by_phase(samples: Samples, chosen: BoolArray, phases: int) -> FloatArray:
    index = samples.phase_index[chosen]
    count = np.bincount(index, minlength=phases)
    total = np.bincount(index, weights=samples.beat_phase[chosen], minlength=phases)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _between_neighbours(phase: FloatArray) -> FloatArray:
    known = np.flatnonzero(~np.isnan(phase))
    every = np.arange(len(phase))
    index = np.concatenate([known[-1:] - len(phase), known, known[:1] + len(phase)])
    value = np.concatenate([phase[known[-1:]] - 1.0, phase[known], phase[known[:1]] + 1.0])
    return np.asarray(np.interp(every, index, value))


def _check_beats(phase: FloatArray, source: str) -> None:
    if np.isnan(phase).all():
        raise refusal(source, "no phase was attempted in a regular beat", "check rr_ms")
    if np.nanmax(phase) >= LATEST_BEAT_PHASE:
        index = int(np.nanargmax(phase))
        raise refusal(
            source,
            f"phase_index {index} lies at {phase[index]:.2f} of its beat (trigger_delay_ms / rr_ms), after "
            "its end",
            "check both columns",
        )


def _check_absent(phase: FloatArray, samples: Samples) -> None:
    """Refuse phases without rows where there is no room for them, or no telling where they lie."""
    absent = np.isnan(phase)
    known = phase[~absent]
    steps = np.diff(known, append=known[0] + 1.0)
    listed = ", ".join(map(str, np.flatnonzero(absent)))
    add = "add a row with its delay and status no_wave for every phase that was attempted"
    if (steps <= 0.0).any():
        raise refusal(
            samples.source,
            f"phase_index {listed} has no row, and the others do not follow the order of the cycle",
            add,
        )
    if absent[-1] and steps[-1] < STEPS_OF_A_GAP * np.median(steps):
        raise refusal(
            samples.source,
            f"its {len(known)} phases fill the cycle, but {samples.phases_source} is {len(phase)}: "
            f"phase_index {listed} has no row",
            f"{add}; if {len(known)} were attempted, say so by --phases or recording.phases",
        )


def _check_distinct(phase: FloatArray, source: str) -> None:
    ordered = np.sort(phase)
    close = np.flatnonzero(np.diff(ordered) < 1e-6)
    if close.size:
        raise refusal(
            source,
            f"two phase indices lie at the same phase {ordered[close[0]]:.4f}",
            "check trigger_delay_ms, or give them one phase_index and several repeats",
        )


def analysis_grid(grid_points: int) -> FloatArray:
    """Return the uniform grid of ``grid_points`` phases on [0, 1], both ends included."""
    return np.linspace(0.0, 1.0, grid_points)


def sample_cycle(cycle_phase: FloatArray, curves: FloatArray, phase: FloatArray) -> FloatArray:
    """Return cycles (..., M) at phases (P,), by a periodic cubic spline; shape (..., P).

    A cycle that holds NaN gives NaN.
    """
    weights = _spline_weights(cycle_phase.tobytes(), phase.tobytes())
    return np.asarray(np.einsum("...m,pm->...p", curves, weights, optimize=False))


def slope_cycle(cycle_phase: FloatArray, curves: FloatArray, phase: FloatArray) -> FloatArray:
    """Return d curve / d phase of the spline of :func:`sample_cycle`; shape (..., P)."""
    weights = _spline_weights(cycle_phase.tobytes(), phase.tobytes(), 1)
    return np.asarray(np.einsum("...m,pm->...p", curves, weights, optimize=False))


def to_grid(phase: FloatArray, values: FloatArray, grid_points: int) -> FloatArray:
    """Interpolate values (..., p) onto the analysis grid (..., G) by periodic, monotone PCHIP.

    The interpolant (Fritsch and Butland 1984) goes through every value and does not overshoot. Its first
    value equals the last. It needs three phases, strictly ascending in [0, 1). Observed and simulated curves
    pass this same function.
    """
    from scipy.interpolate import PchipInterpolator

    _check_phases(phase)
    knots = np.concatenate([phase[-WRAP:] - 1.0, phase, phase[:WRAP] + 1.0])
    rows = values.reshape(-1, len(phase))
    curves = np.empty((len(rows), grid_points))
    grid = analysis_grid(grid_points)
    for start in range(0, len(rows), CHUNK):
        chunk = rows[start : start + CHUNK]
        wrapped = np.concatenate([chunk[:, -WRAP:], chunk, chunk[:, :WRAP]], axis=1)
        curves[start : start + CHUNK] = PchipInterpolator(knots, wrapped, axis=1)(grid)
    curves[:, -1] = curves[:, 0]
    return curves.reshape(*values.shape[:-1], grid_points)


@lru_cache(maxsize=256)
def _spline_weights(cycle_phase: bytes, phase: bytes, derivative: int = 0) -> FloatArray:
    """Return what each value of a cycle (M,) counts in its spline at phases (P,), or in a slope; (P, M)."""
    first, spline = np.frombuffer(cycle_phase)[0], _cardinal_spline(cycle_phase)
    weights = np.ascontiguousarray(spline(first + (np.frombuffer(phase) - first) % 1.0, derivative))
    weights.flags.writeable = False
    return weights


@lru_cache(maxsize=8)
def _cardinal_spline(cycle_phase: bytes) -> CubicSpline:
    from scipy.interpolate import CubicSpline

    # The spline is linear in the values: its cardinal functions, once, serve every curve.
    nodes = np.frombuffer(cycle_phase)
    cardinal = np.vstack([np.eye(len(nodes)), np.eye(len(nodes))[:1]])
    return CubicSpline(np.append(nodes, nodes[0] + 1.0), cardinal, bc_type="periodic")


def _check_phases(phase: FloatArray) -> None:
    if len(phase) < 3:
        raise ValueError(f"interpolation around the cycle needs at least 3 measured phases, got {len(phase)}")
    if phase[0] < 0.0 or phase[-1] >= 1.0 or np.any(np.diff(phase) <= 0.0):
        listed = ", ".join(f"{value:.4g}" for value in phase)
        raise ValueError(f"phases must ascend strictly within [0, 1), got {listed}")
