"""Whether a recording as a whole can be what its columns say: what no single cell shows."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.recording.problems import Problem
from swesbi.recording.samples import SPEED, Samples
from swesbi.recording.settings import RecordingSettings

# Half the time the myocardium is near its diastolic 0.9-1.5 m/s in health, and up to several times that in
# the stiffest disease (Song et al. 2016, Santos et al. 2019); a wrong unit is off by ten at least.
MEDIAN_SPEED_RANGE_M_S: Final = (0.5, 10.0)
# Late diastole must have been measured, so the last push comes late in its beat.
LEAST_REACH: Final = 0.5


def implausible(
    samples: Samples, accepted: NDArray[np.bool_], context: Context, settings: RecordingSettings
) -> tuple[Problem, ...]:
    """Return what cannot be true of a recording: its heart rate, its delays, its speeds.

    Args:
        samples: The recording, N samples.
        accepted: Which samples passed quality control; shape (N,), at least one.
        context: The subject's context.
        settings: Holds the largest deviation of RR.
    """
    found = (
        _heart_rate(samples, context, settings.max_rr_deviation_fraction),
        _delays(samples),
        _speeds(samples, accepted),
    )
    return tuple(problem for problem in found if problem)


def _heart_rate(samples: Samples, context: Context, limit: float) -> Problem | None:
    beats = samples.frame().groupby(["phase_index", "repeat"])["rr_ms"].median()
    median = float(beats.median())
    expected = 1e3 * context.period_s
    if abs(median / expected - 1.0) <= limit:
        return None
    reason = (
        f"the median RR interval is {median:.0f} ms ({6e4 / median:.0f} beats per minute), but hr_bpm of "
        f"{context.subject} in subjects.csv is {context.hr_bpm:g} ({expected:.0f} ms), limit {limit:.0%}"
    )
    return Problem(samples.source, reason, "give the heart rate of this recording", column="rr_ms")


def _delays(samples: Samples) -> Problem | None:
    reach = float(samples.beat_phase.max())
    if reach >= LEAST_REACH:
        return None
    longest = f"{samples.trigger_delay_ms.max():g} ms"
    reason = f"the longest trigger delay is {longest}, and reaches {reach:.3f} of its beat"
    remedy = "give the delay from the R peak in ms, up to late diastole"
    return Problem(samples.source, reason, remedy, column="trigger_delay_ms")


def _speeds(samples: Samples, accepted: NDArray[np.bool_]) -> Problem | None:
    median = float(np.median(samples.speed_m_s[accepted]))
    low, high = MEDIAN_SPEED_RANGE_M_S
    if low <= median <= high:
        return None
    reason = f"the median shear-wave speed is {median:.3g} m/s, expected {low:g} to {high:g}"
    return Problem(samples.source, reason, "check the unit: m/s, or kPa for a modulus", column=SPEED)
