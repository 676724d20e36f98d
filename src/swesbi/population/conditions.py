"""Under which conditions the recordings are made that a network learns from: gated, or free-running.

Whatever its points, a network sees a recording in the cells of the cycle (``networks.flow.conditioning``),
and so it is drawn there: a gated one at the phases of its protocol, the centres of the cells; a free-running
one at the mean instant of the pushes of each cell, with the error of their mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.networks.flow.conditioning import pool_points
from swesbi.population.settings import ConditionSettings, FreeConditionSettings
from swesbi.recording.ingest import BEAT_VARIATION, ROUNDING
from swesbi.recording.noise.errors import MeanErrors, mean_errors, relative_se
from swesbi.recording.phases import nominal_phases
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.recording.speed import NoiseComponents


@dataclass(frozen=True)
class Conditions:
    """Of n recordings at the P phases of a protocol, each phase with its own number of failed samples.

    ``level`` (n,) is the standard error of the mean speed of a phase without failed samples, over the speed.
    ``errors``, own and shared, are (n, P) and (n, P, R); ``measured`` (n, P) says which phases were measured.
    """

    level: FloatArray
    errors: MeanErrors
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
    failed samples, those whose wave was not found and those that quality control takes for outliers. Sweeps,
    repeats and samples have the ratio that they have in the protocol; no repeat fails as a whole. A
    ValueError says that there is no such recording, of so few phases.
    """
    low, high = np.log(settings.relative_se)
    level = np.exp(rng.uniform(low, high, number))
    lost = protocol.failed_fraction + protocol.outlier_fraction
    counts = rng.binomial(
        protocol.samples_per_repeat, 1.0 - lost, (number, protocol.phases, protocol.repeats)
    )
    flat = mean_errors(np.maximum(counts, 1).reshape(-1, protocol.repeats), protocol_noise(protocol))
    whole, shape = whole_phase_se(protocol), (number, protocol.phases)
    errors = MeanErrors(
        level[:, None] * (flat.own.reshape(shape) / whole),
        level[:, None, None] * (flat.shared.reshape(*shape, flat.shared.shape[1]) / whole),
    )
    return Conditions(level, errors, _draw_measured(number, settings, recording, rng))


def protocol_noise(protocol: AcquisitionSettings) -> NoiseComponents:
    """Return the noise components that the protocol itself has."""
    return NoiseComponents(protocol.repeat_sd_fraction, protocol.sample_sd_fraction, protocol.sweep_fraction)


def whole_phase_se(protocol: AcquisitionSettings) -> float:
    """Return the relative standard error that it gives the mean speed of a phase without failed samples."""
    whole = np.full((1, protocol.repeats), protocol.samples_per_repeat)
    return float(relative_se(whole, protocol_noise(protocol))[0])


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
    if not admitted(np.ones((1, len(phase)), dtype=bool), phase, recording).all():
        raise ValueError(
            f"recording.phases = {recording.phases}: not even all of them are enough for max_gap_fraction "
            "and min_late_diastolic_phases; attempt more phases, or change these"
        )
    measured = np.zeros((number, len(phase)), dtype=bool)
    pending = np.arange(number)
    while pending.size:
        rate = rng.uniform(0.0, settings.missing_fraction, pending.size)
        measured[pending] = rng.random((pending.size, len(phase))) >= rate[:, None]
        pending = pending[~admitted(measured[pending], phase, recording)]
    return measured


def _longest_run(missing: BoolArray) -> IntArray:
    """Return the longest run of missing phases around the cycle; shape (n,)."""
    twice = np.concatenate([missing, missing], axis=1)
    position = np.arange(twice.shape[1])
    latest = np.maximum.accumulate(np.where(twice, -1, position), axis=1)
    return np.asarray((position - latest)[:, missing.shape[1] :].max(axis=1))


@dataclass(frozen=True)
class FreePushes:
    """Of n free-running recordings, N pushes in all.

    ``row`` (N,), ascending, is the number of each push's recording; ``phase`` (N,) is its instant in [0, 1).
    ``relative_se`` (N,) is the standard error of its speed over it, where declared its prior median. All
    errors of a recording are multiplied by ``factor`` (n,), 1 where they are known. ``errors_log_sd`` (n,) is
    the prior standard deviation of the logarithm of that, 0 where they are known.
    """

    row: IntArray
    phase: FloatArray
    relative_se: FloatArray
    factor: FloatArray
    errors_log_sd: FloatArray


def draw_pushes(number: int, settings: FreeConditionSettings, rng: np.random.Generator) -> FreePushes:
    """Draw when n free-running recordings have accepted pushes, and the errors of their speeds."""
    fewest, most = settings.pushes
    counts = np.exp(rng.uniform(np.log(fewest), np.log(most + 1), number)).astype(np.int64)
    row = np.repeat(np.arange(number), counts)
    least, largest = np.log(settings.relative_se)
    level = rng.uniform(least, largest, number)
    log_se = level[row] + settings.spread_log_sd * rng.standard_normal(len(row))
    narrow = rng.random(number) < 0.5
    window = np.where(narrow, rng.uniform(settings.least_window, 1.0, number), 1.0)
    phase = (rng.random(number)[row] + window[row] * rng.random(len(row))) % 1.0
    declared = rng.random(number) < 0.5
    log_sd = np.where(declared, rng.uniform(0.0, settings.most_errors_log_sd, number), 0.0)
    factor = np.exp(log_sd * rng.standard_normal(number))
    return FreePushes(row, phase, np.exp(log_se), factor, log_sd)


@dataclass(frozen=True)
class CellConditions:
    """Of n recordings in the P cells of the cycle.

    ``errors`` of the mean speeds, own (n, P) and shared (n, P, R), are as they are; ``relative_se`` (n, P) is
    their total as it is known. ``measured`` (n, P) says which cells hold a point. ``offset`` (n, P) is the
    mean instant of the points less the centre of the cell, in widths of a cell. ``errors_log_sd`` (n,) is the
    prior standard deviation of the log of a factor of all errors.
    """

    errors: MeanErrors
    relative_se: FloatArray
    measured: BoolArray
    offset: FloatArray
    errors_log_sd: FloatArray


def draw_cells(
    number: int,
    settings: ConditionSettings,
    protocol: AcquisitionSettings,
    recording: RecordingSettings,
    rng: np.random.Generator,
) -> CellConditions:
    """Draw the conditions of recordings of both kinds, in the cells that are the phases of the protocol."""
    gated = draw_conditions(number, settings, protocol, recording, rng)
    free = np.flatnonzero(rng.random(number) < settings.free_running.share)
    pushes = draw_pushes(len(free), settings.free_running, rng)
    pooled = pool_points(pushes.row, pushes.phase, pushes.relative_se, len(free), protocol.phases)
    own, shared, told = gated.errors.own.copy(), gated.errors.shared.copy(), gated.errors.total
    own[free], shared[free], told[free] = pushes.factor[:, None] * pooled.relative_se, 0.0, pooled.relative_se
    measured, offset, log_sd = gated.measured.copy(), np.zeros(told.shape), np.zeros(number)
    measured[free], offset[free], log_sd[free] = pooled.measured, pooled.offset, pushes.errors_log_sd
    return CellConditions(MeanErrors(own, shared), told, measured, offset, log_sd)
