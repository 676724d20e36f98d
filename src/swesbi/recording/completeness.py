"""Whether enough phases of a recording were measured."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.recording.problems import Problem
from swesbi.recording.settings import RecordingSettings

FloatArray = NDArray[np.float64]
ROUNDING: Final = 1e-9
# Beats differ in length, so neighbouring phases lie a little nearer or farther than the protocol puts them.
BEAT_VARIATION: Final = 0.01


def incomplete(
    phase: FloatArray, measured: NDArray[np.bool_], settings: RecordingSettings, source: str
) -> tuple[Problem, ...]:
    """Return in what a recording is incomplete: missing phases, too long a gap, too little late diastole.

    Args:
        phase: Phases in ascending order; shape (P,).
        measured: Which of them were measured, at least one; shape (P,).
        settings: Holds the three limits.
        source: The recording, for messages.
    """
    missing = ", ".join(f"{value:.3f}" for value in phase[~measured])
    advice = f"missing phases: {missing or 'none'}; record them again or leave the subject out"
    reasons = (
        _fraction(measured, settings),
        _gap(phase[measured], settings.max_gap_fraction),
        _late_diastole(phase[measured], settings),
    )
    return tuple(Problem(source, reason, advice) for reason in reasons if reason)


def longest_gap(measured_phase: FloatArray) -> tuple[float, float]:
    """Return the longest distance between neighbouring phases around the cycle, and where it starts."""
    steps = np.diff(measured_phase, append=measured_phase[0] + 1.0)
    longest = int(np.argmax(steps))
    return float(steps[longest]), float(measured_phase[longest])


def _fraction(measured: NDArray[np.bool_], settings: RecordingSettings) -> str:
    fraction, limit = float(np.mean(~measured)), settings.max_missing_fraction
    if fraction <= limit + ROUNDING:
        return ""
    return (
        f"{fraction:.0%} of the phases are missing, limit {limit:.0%} ({int(measured.sum())} of the "
        f"{len(measured)} of recording.phases in config.yaml were measured)"
    )


def _gap(measured_phase: FloatArray, limit: float) -> str:
    gap, start = longest_gap(measured_phase)
    if gap <= limit + BEAT_VARIATION:
        return ""
    return f"no phase was measured for {gap:.3f} of the cycle after {start:.3f}, limit {limit:g}"


def _late_diastole(measured_phase: FloatArray, settings: RecordingSettings) -> str:
    (low, high), least = settings.late_diastolic_window, settings.min_late_diastolic_phases
    late = int(np.count_nonzero((measured_phase >= low) & (measured_phase <= high)))
    if late >= least:
        return ""
    return (
        f"{late} phases were measured in late diastole, [{low:g}, {high:g}] of the cycle, but the passive "
        f"baseline needs {least}"
    )
