"""Quality control of a gated recording: which samples are accepted, and which whole phases are left out.

Of any recording: speeds that a scanner seems to have clipped.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import chdtr

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.neighbours import told_by_neighbours
from swesbi.recording.samples import ACCEPTED, OUTLIER, Samples, sample_rejection
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import average_speeds

STEPS: Final = 10
"""Of the resolution below the largest speed, in which others are counted."""
RARE: Final = 1.0e-4


def rejection(samples: Samples, settings: RecordingSettings) -> IntArray:
    """Return for each sample the index into ``REASONS`` of its rejection, or ``ACCEPTED``; shape (N,).

    First as of :func:`swesbi.recording.samples.sample_rejection`; then all samples of a phase whose mean
    speed lies far outside its neighbours are outliers.
    """
    verdict = sample_rejection(samples, settings)
    far = ~np.isnan(_told(samples, verdict == ACCEPTED, settings)[1])
    verdict[far[samples.phase_index] & (verdict == ACCEPTED)] = OUTLIER
    return verdict


def phases_left_out(samples: Samples, settings: RecordingSettings) -> tuple[str, ...]:
    """Name the phases that are left out as a whole, with their speed and what their neighbours say."""
    speed, told = _told(samples, sample_rejection(samples, settings) == ACCEPTED, settings)
    return tuple(
        f"outlier: phase_index {index} is left out: its mean speed is {speed[index]:.3g} m/s, and "
        f"{told[index]:.3g} by its neighbours"
        for index in np.flatnonzero(~np.isnan(told))
    )


def _told(
    samples: Samples, accepted: BoolArray, settings: RecordingSettings
) -> tuple[FloatArray, FloatArray]:
    """Return the mean speed of each phase, NaN where none, and what the neighbours say of far ones; (P,)."""
    count = int(samples.phase_index.max()) + 1
    told, speed = np.full((2, count), np.nan)
    if np.unique(samples.phase_index[accepted]).size < settings.outlier_min_points:
        return speed, told
    means = average_speeds(samples, accepted, count)
    speed, known = means.speed_m_s, ~np.isnan(means.speed_m_s)
    error = (means.speed_se_m_s / speed)[known]
    told[known] = told_by_neighbours(means.beat_phase[known] % 1.0, speed[known], error, settings)
    return speed, told


def clipped(speed_m_s: FloatArray) -> tuple[str, ...]:
    """Say where more speeds than their resolution allows are the largest of all; nothing where none are.

    Just below the largest, speeds fall into steps of the resolution; so many would fall into one by chance,
    and one more. What has by this a chance (Poisson) below ``RARE`` is no chance.

    Args:
        speed_m_s: Speeds of the table, NaN where there is none; shape (N,).
    """
    known = np.sort(speed_m_s[np.isfinite(speed_m_s)])
    steps = np.diff(np.unique(known))
    if steps.size < STEPS:
        return ()
    largest, step = float(known[-1]), float(steps.min())
    number = int((known == largest).sum())
    near = float((known >= largest - (STEPS + 0.5) * step).sum() - number) / STEPS
    if chdtr(2 * number, 2.0 * (1.0 + near)) >= RARE:
        return ()
    share = f"{number} of {len(known)} speeds are the largest of all, {largest:g} m/s"
    return (f"{share}: they seem to be clipped, so the curve may be higher there",)
