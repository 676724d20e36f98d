"""Speeds far outside their neighbours along the cycle: one rule for gated phases and for single pushes.

But for a steep rise and fall the speed changes slowly, so its neighbours predict a speed. Its log is taken
for a random walk around the cycle that comes back to where it began. A rise within one step stays, however
high: what lies between its two nearest neighbours is never far outside.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.recording.samples import MAD_TO_SD
from swesbi.recording.settings import RecordingSettings

EACH_SIDE: Final = 8
"""Neighbours on each side that predict a speed."""
LEVEL_SD: Final = 1.0
"""Prior standard deviation of the mean log speed about the median: a factor of 2.7."""
TENTH: Final = 0.1
"""Of the cycle, over which the setting says how far the walk goes."""
BEYOND: Final = 0.5
"""Share of the largest z-score by which a speed also lies beyond the nearer of its two neighbours."""


def speed_by_neighbours(
    phase: FloatArray, speed_m_s: FloatArray, relative_se: FloatArray, settings: RecordingSettings
) -> FloatArray:
    """Return what the neighbours say of each speed that lies far outside them, in m/s; else NaN; shape (n,).

    Phases are in [0, 1), and standard errors are fractions of the speeds; each of shape (n,). The farthest
    speed is taken out first, and the others are judged without it. Of fewer speeds than
    ``settings.outlier_min_points`` none is far outside. The order of the speeds does not matter.
    """
    told = np.full(len(phase), np.nan)
    left = np.argsort(speed_m_s, kind="stable")
    left = left[np.argsort(phase[left], kind="stable")]
    se = np.maximum(relative_se, settings.outlier_min_scale_fraction)
    log_speed = np.log(speed_m_s)
    while len(left) >= settings.outlier_min_points:
        score, said = _far(phase[left], log_speed[left], se[left], settings)
        farthest = int(np.argmax(score))
        if score[farthest] == 0.0:
            break
        told[left[farthest]] = np.exp(said[farthest])
        left = left[np.arange(len(left)) != farthest]
    return told


def _far(
    phase: FloatArray, log_speed: FloatArray, se: FloatArray, settings: RecordingSettings
) -> tuple[FloatArray, FloatArray]:
    """Return the z-score of each of n speeds in order of phase, 0 if not far outside, and what is said."""
    said, sd = _given_others(phase, log_speed, se, settings.outlier_change_per_tenth_log_sd)
    z = np.abs(log_speed - said) / sd
    factor = max(1.0, MAD_TO_SD * float(np.median(z)))
    z, limit = z / factor, settings.outlier_max_abs_z
    far = (z > limit) & _beyond(log_speed, BEYOND * limit * factor * se)
    return np.where(far, z, 0.0), said


def _beyond(log_speed: FloatArray, error: FloatArray) -> BoolArray:
    """Tell which lie beyond both nearest neighbours, by more than the errors of each difference."""
    beside = np.stack([np.roll(log_speed, 1), np.roll(log_speed, -1)])
    distance = log_speed - beside
    allowed = np.hypot(error, np.stack([np.roll(error, 1), np.roll(error, -1)]))
    above, below = (distance > allowed).all(axis=0), (distance < -allowed).all(axis=0)
    return np.asarray(above | below)


def _given_others(
    phase: FloatArray, log_speed: FloatArray, se: FloatArray, change: float
) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of each log speed given its neighbours; (n,) each.

    A random walk of variance D a cycle that is back after one has the covariance D (d^2 - d + 1/6) / 2 at a
    distance d. Given all others, value i has by the inverse Q of the covariance the variance 1 / Q_ii, and
    it lies (Q y)_i / Q_ii from its mean (Rasmussen and Williams, Gaussian Processes, 2006, Eq. 5.12).
    """
    count = len(phase)
    side = min(EACH_SIDE, (count - 1) // 2)
    near = (np.arange(count)[:, None] + np.arange(-side, side + 1)) % count
    apart = np.abs(phase[near][:, :, None] - phase[near][:, None, :])
    walk = 0.5 * change**2 / TENTH * (apart**2 - apart + 1.0 / 6.0)
    own = np.eye(2 * side + 1) * (se[near] ** 2)[:, None, :]
    unit = np.broadcast_to(np.eye(2 * side + 1)[:, side : side + 1], (count, 2 * side + 1, 1))
    row = np.linalg.solve(walk + own + LEVEL_SD**2, unit)[..., 0]
    variance = 1.0 / row[:, side]
    centred = log_speed - np.median(log_speed)
    residual = variance * np.sum(row * centred[near], axis=1)
    return log_speed - residual, np.sqrt(variance)
