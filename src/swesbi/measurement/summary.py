"""The summary S(.): 16 scalar descriptors of a stiffness curve and 30 uniformly resampled values.

Curves live on the uniform grid s in [0, 1] from the R peak. Levels of rise and relaxation are fractions
of the amplitude above the baseline; the amplitude is maximum minus baseline. Times are fractions of the
cycle, areas kPa times cycle, that is kPa, slopes kPa per cycle, falling ones negative. Peak and crossings are
found by ``swesbi.measurement.landmarks``, in one of two variants.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.measurement.landmarks import LANDMARKS, Peak
from swesbi.measurement.settings import SCALARS, SummarySettings, summary_names
from swesbi.recording.phases import analysis_grid

CHUNK: Final = 2048  # rows; keeps the work arrays within the processor's cache


def summarise(curves: FloatArray, settings: SummarySettings) -> FloatArray:
    """Return the features x = S(E) of stiffness curves (paper, Eq. 4), in the order of ``summary_names``.

    Curves in kPa on the analysis grid are (n, G), features (n, F), F = 46 in the study. Every feature depends
    continuously on a curve with one peak; a level never crossed counts as crossed at an end of the cycle.
    """
    if curves.ndim != 2 or not np.isfinite(curves).all():
        raise ValueError(f"curves must be finite, of shape (n, grid); got shape {curves.shape} or NaN in it")
    features = np.empty((len(curves), len(summary_names(settings))))
    for start in range(0, len(curves), CHUNK):
        chunk = np.asarray(curves[start : start + CHUNK], dtype=np.float64)
        scalars = _scalars(chunk, settings)
        features[start : start + CHUNK, : len(SCALARS)] = np.stack(scalars, axis=1)
        if settings.use_trajectory:
            features[start : start + CHUNK, len(SCALARS) :] = _resample(chunk, settings.trajectory_points)
    return features


def _scalars(curves: FloatArray, settings: SummarySettings) -> tuple[FloatArray, ...]:
    grid = analysis_grid(curves.shape[1])
    step = grid[1] - grid[0]
    find = LANDMARKS[settings.landmarks]
    baseline = curves[:, _within(grid, settings.baseline_window)].mean(axis=1)
    peak = find.peak(grid, curves, baseline)
    amplitude = np.maximum(peak.height - baseline, 0.0)
    rise = {f: find.before(grid, curves, peak, baseline + f * amplitude) for f in (0.1, 0.5, 0.9)}
    fall = {f: find.after(grid, curves, peak, baseline + f * amplitude) for f in (0.1, 0.5, 0.9)}
    slope = np.diff(curves, axis=1) / step
    if settings.decay_slope == "peak_to_end":
        drop, lasting = peak.height - curves[:, -1], 1.0 - peak.phase
    else:
        drop, lasting = 0.8 * amplitude, fall[0.1] - fall[0.9]
    return (
        baseline,
        curves.min(axis=1),
        peak.height,
        amplitude,
        (curves.sum(axis=1) - 0.5 * (curves[:, 0] + curves[:, -1])) * step,
        _area_after(grid, curves, peak),
        slope.max(axis=1),
        0.8 * amplitude / np.maximum(rise[0.9] - rise[0.1], 0.8 * step),
        peak.phase,
        rise[0.9] - rise[0.1],
        rise[0.5],
        slope.min(axis=1),
        -drop / np.maximum(lasting, 0.8 * step),
        fall[0.5] - peak.phase,
        fall[0.1] - peak.phase,
        fall[0.5] - rise[0.5],
    )


def _area_after(grid: FloatArray, curves: FloatArray, peak: Peak) -> FloatArray:
    """Integrate from the refined peak to the end of the cycle by trapezia, the first one cut at the peak."""
    areas = 0.5 * (curves[:, 1:] + curves[:, :-1]) * (grid[1] - grid[0])
    later = grid[:-1] >= peak.phase[:, None]
    following = np.minimum(np.searchsorted(grid, peak.phase), len(grid) - 1)
    cut = (grid[following] - peak.phase) * 0.5 * (peak.height + curves[np.arange(len(curves)), following])
    return np.asarray((areas * later).sum(axis=1) + cut)


def _resample(curves: FloatArray, points: int) -> FloatArray:
    """Read the curves at ``points`` uniform phases j / points: the end, equal to the start, is left out."""
    position = np.arange(points) / points * (curves.shape[1] - 1)
    start = np.floor(position).astype(np.int64)
    fraction = position - start
    return np.asarray((1.0 - fraction) * curves[:, start] + fraction * curves[:, start + 1])


def _within(grid: FloatArray, window: tuple[float, float]) -> BoolArray:
    inside = (grid >= window[0]) & (grid <= window[1])
    if not inside.any():
        raise ValueError(f"baseline_window {list(window)} holds no point of a grid of {len(grid)}; widen it")
    return inside
