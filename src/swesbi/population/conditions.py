"""Under which conditions a recording is made: which phases are missed, and how noisy each mean speed is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.noise.error import relative_se
from swesbi.population.settings import ConditionSettings
from swesbi.recording.completeness import BEAT_VARIATION
from swesbi.recording.phases import nominal_phases
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.virtual_cohort.settings import AcquisitionSettings

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class Conditions:
    """Of n recordings at the P phases of a protocol.

    Attributes:
        level: Standard error of the mean speed of a phase without failed samples, over the speed; shape (n,).
        relative_se: Standard error at each phase, with its own number of failed samples; shape (n, P).
        measured: Which phases were measured; shape (n, P).
    """

    level: FloatArray
    relative_se: FloatArray
    measured: BoolArray


def draw_conditions(
    number: int,
    settings: ConditionSettings,
    protocol: AcquisitionSettings,
    recording: RecordingSettings,
    rng: np.random.Generator,
) -> Conditions:
    """Draw the conditions of recordings that ingestion would admit.

    The noise of a whole phase is drawn; how it varies from phase to phase follows from the protocol's
    failed samples, those whose wave was not found and those that quality control takes for outliers.
    """
    low, high = np.log(settings.relative_se)
    level = np.exp(rng.uniform(low, high, number))
    lost = protocol.failed_fraction + protocol.outlier_fraction
    counts = rng.binomial(
        protocol.samples_per_repeat, 1.0 - lost, (number, protocol.phases, protocol.repeats)
    )
    unit = NoiseComponents(protocol.repeat_sd_fraction, protocol.sample_sd_fraction)
    whole = np.full((1, protocol.repeats), protocol.samples_per_repeat)
    flat = relative_se(np.maximum(counts, 1).reshape(-1, protocol.repeats), unit)
    ratio = flat.reshape(number, protocol.phases) / relative_se(whole, unit)
    return Conditions(level, level[:, None] * ratio, _draw_measured(number, settings, recording, rng))


def admitted(measured: BoolArray, phase: FloatArray, recording: RecordingSettings) -> BoolArray:
    """Tell which of n recordings have enough phases (n, P), by the three limits of ingestion; shape (n,)."""
    missing = (~measured).mean(axis=1) <= recording.max_missing_fraction + ROUNDING
    low, high = recording.late_diastolic_window
    late = measured[:, (phase >= low) & (phase <= high)].sum(axis=1) >= recording.min_late_diastolic_phases
    gap = (_longest_run(~measured) + 1) / len(phase) <= recording.max_gap_fraction + BEAT_VARIATION
    return np.asarray(missing & late & gap)


def _draw_measured(
    number: int, settings: ConditionSettings, recording: RecordingSettings, rng: np.random.Generator
) -> BoolArray:
    phase = nominal_phases(recording.phases)
    measured = np.zeros((number, len(phase)), dtype=bool)
    pending = np.arange(number)
    while pending.size:
        rate = rng.uniform(0.0, settings.missing_fraction, pending.size)
        measured[pending] = rng.random((pending.size, len(phase))) >= rate[:, None]
        pending = pending[~admitted(measured[pending], phase, recording)]
    return measured


def _longest_run(missing: BoolArray) -> NDArray[np.int64]:
    """Return the longest run of missing phases around the cycle; shape (n,)."""
    twice = np.concatenate([missing, missing], axis=1)
    position = np.arange(twice.shape[1])
    latest = np.maximum.accumulate(np.where(twice, -1, position), axis=1)
    return np.asarray((position - latest)[:, missing.shape[1] :].max(axis=1))
