"""The phases of a recording: where each lies in the cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.samples import Samples

FloatArray = NDArray[np.float64]
LATEST_BEAT_PHASE = 1.1
# Between one step from phase to phase, where nothing is missing, and the two that one missing phase leaves.
STEPS_OF_A_GAP = 1.5


def nominal_phases(phases: int) -> FloatArray:
    """Return the phases of a protocol, the centres of equal parts of the cycle; shape (phases,)."""
    return np.asarray((np.arange(phases) + 0.5) / phases)


def locate_phases(samples: Samples, measured_phase: FloatArray, beats: NDArray[np.bool_]) -> FloatArray:
    """Return the phase of every gated acquisition as a fraction of the cycle, shape (P,), in [0, 1).

    A measured phase keeps the mean over its accepted repeats. A phase whose attempts all failed still
    has rows, and lies at their mean trigger delay / RR. A phase without rows lies between its
    neighbours, in proportion to the phase index; then the indices must follow the cycle.

    Args:
        samples: The recording, N attempted samples.
        measured_phase: Mean beat phase of the accepted repeats, NaN where none; shape (P,).
        beats: Which samples lie in a beat of regular RR; shape (N,).

    Raises:
        RecordingError: A push lies beyond the end of its beat, no phase has a row, two phases coincide, or
            phases without rows have no place.
    """
    attempted = _mean_by_phase(samples, beats, len(measured_phase))
    phase = np.where(np.isnan(measured_phase), attempted, measured_phase)
    _check_beats(phase, samples.source)
    if np.isnan(phase).any():
        _check_absent(phase, samples.source)
    wrapped = _between_neighbours(phase) % 1.0
    _check_distinct(wrapped, samples.source)
    return wrapped


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


def _check_beats(phase: FloatArray, source: str) -> None:
    if np.isnan(phase).all():
        raise RecordingError(Problem(source, "no phase was attempted in a regular beat", "check rr_ms"))
    if np.nanmax(phase) >= LATEST_BEAT_PHASE:
        index = int(np.nanargmax(phase))
        place = f"{phase[index]:.2f} of its beat (trigger_delay_ms / rr_ms)"
        reason = f"phase_index {index} lies at {place}, after its end"
        raise RecordingError(Problem(source, reason, "check both columns"))


def _check_absent(phase: FloatArray, source: str) -> None:
    """Refuse phases without rows where there is no room for them, or no telling where they lie."""
    absent = np.isnan(phase)
    known = phase[~absent]
    steps = np.diff(known, append=known[0] + 1.0)
    listed = ", ".join(map(str, np.flatnonzero(absent)))
    add = "add a row with its delay and status no_wave for every phase that was attempted"
    if (steps <= 0.0).any():
        reason = f"phase_index {listed} has no row, and the others do not follow the order of the cycle"
        raise RecordingError(Problem(source, reason, add))
    if absent[-1] and steps[-1] < STEPS_OF_A_GAP * np.median(steps):
        reason = (
            f"its {len(known)} phases fill the cycle, but recording.phases in config.yaml is {len(phase)}: "
            f"phase_index {listed} has no row"
        )
        raise RecordingError(Problem(source, reason, f"set recording.phases to {len(known)}, or {add}"))


def _check_distinct(phase: FloatArray, source: str) -> None:
    ordered = np.sort(phase)
    close = np.flatnonzero(np.diff(ordered) < 1e-6)
    if close.size:
        reason = f"two phase indices lie at the same phase {ordered[close[0]]:.4f}"
        remedy = "check trigger_delay_ms, or give them one phase_index and several repeats"
        raise RecordingError(Problem(source, reason, remedy))
