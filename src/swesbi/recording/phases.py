"""The phases of a recording: where each lies in the cycle, and whether enough of them were measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.recording.samples import RecordingError, Samples
from swesbi.recording.settings import RecordingSettings

FloatArray = NDArray[np.float64]
LATEST_BEAT_PHASE = 1.1
ROUNDING = 1e-9
# Beats differ in length, so neighbouring phases lie a little nearer or farther than the protocol puts them.
BEAT_VARIATION = 0.01


def locate_phases(samples: Samples, measured_phase: FloatArray, beats: NDArray[np.bool_]) -> FloatArray:
    """Return the phase of every gated acquisition as a fraction of the cycle, shape (P,), in [0, 1).

    A measured phase keeps the mean over its accepted repeats. A phase whose attempts all failed still
    has rows, and lies at their mean trigger delay / RR. A phase without rows lies between its
    neighbours, in proportion to the phase index.

    Args:
        samples: The recording, N attempted samples.
        measured_phase: Mean beat phase of the accepted repeats, NaN where none; shape (P,).
        beats: Which samples lie in a beat of regular RR; shape (N,).

    Raises:
        RecordingError: A push lies beyond the end of its beat, no phase has a row, or two phases coincide.
    """
    attempted = _mean_by_phase(samples, beats, len(measured_phase))
    phase = np.where(np.isnan(measured_phase), attempted, measured_phase)
    if np.isnan(phase).all():
        raise RecordingError(f"{samples.source}: no phase was attempted in a regular beat; check rr_ms")
    if np.nanmax(phase) >= LATEST_BEAT_PHASE:
        index = int(np.nanargmax(phase))
        raise RecordingError(
            f"{samples.source}: phase_index {index} lies at {phase[index]:.2f} of its beat "
            "(trigger_delay_ms / rr_ms), after its end; check both columns"
        )
    wrapped = _between_neighbours(phase) % 1.0
    _check_distinct(wrapped, samples.source)
    return wrapped


def check_completeness(
    phase: FloatArray, measured: NDArray[np.bool_], settings: RecordingSettings, source: str
) -> None:
    """Refuse a recording with too many missing phases, too long a gap, or too little late diastole.

    Args:
        phase: Phases in ascending order; shape (P,).
        measured: Which of them were measured; shape (P,).
        settings: Holds the three limits.
        source: The recording, for messages.

    Raises:
        RecordingError: A limit is exceeded; the message gives the value, the limit and the phases.
    """
    missing = ", ".join(f"{value:.3f}" for value in phase[~measured])
    advice = f"missing phases: {missing or 'none'}; record them again or leave the subject out"
    fraction = float(np.mean(~measured))
    if fraction > settings.max_missing_fraction + ROUNDING:
        limit = settings.max_missing_fraction
        raise RecordingError(
            f"{source}: {fraction:.0%} of the phases are missing, limit {limit:.0%}; {advice}"
        )
    gap, start = longest_gap(phase[measured])
    if gap > settings.max_gap_fraction + BEAT_VARIATION:
        raise RecordingError(
            f"{source}: no phase was measured for {gap:.3f} of the cycle after {start:.3f}, "
            f"limit {settings.max_gap_fraction:g}; {advice}"
        )
    low, high = settings.late_diastolic_window
    late = int(np.count_nonzero(measured & (phase >= low) & (phase <= high)))
    if late < settings.min_late_diastolic_phases:
        raise RecordingError(
            f"{source}: {late} phases were measured in late diastole, [{low:g}, {high:g}] of the cycle, "
            f"but the passive baseline needs {settings.min_late_diastolic_phases}; {advice}"
        )


def longest_gap(measured_phase: FloatArray) -> tuple[float, float]:
    """Return the longest distance between neighbouring phases around the cycle, and where it starts."""
    steps = np.diff(measured_phase, append=measured_phase[0] + 1.0)
    longest = int(np.argmax(steps))
    return float(steps[longest]), float(measured_phase[longest])


def _mean_by_phase(samples: Samples, chosen: NDArray[np.bool_], phases: int) -> FloatArray:
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


def _check_distinct(phase: FloatArray, source: str) -> None:
    ordered = np.sort(phase)
    close = np.flatnonzero(np.diff(ordered) < 1e-6)
    if close.size:
        raise RecordingError(
            f"{source}: two phase indices lie at the same phase {ordered[close[0]]:.4f}; "
            "check trigger_delay_ms, or give them one phase_index and several repeats"
        )
