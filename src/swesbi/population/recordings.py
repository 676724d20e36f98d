"""Fresh recordings of fresh contexts, and the conditions under which they are made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.arrays import BoolArray, FloatArray, IntArray
from swesbi.base import Settings
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.measurement.speeds import SpeedRecording
from swesbi.population.contexts import draw_contexts
from swesbi.population.settings import ConditionSettings, PopulationSettings
from swesbi.population.synthetic import Acquisition, Synthetic, acquired_recordings, own_recordings
from swesbi.recording.ingest import BEAT_VARIATION
from swesbi.recording.noise import MeanErrors, mean_errors, relative_se
from swesbi.recording.phases import nominal_phases
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator
from swesbi.virtual_cohort.settings import AcquisitionSettings

ROUNDING: Final = 1e-9
OWN: Final = "own"
ACQUIRED: Final = "acquired"


@dataclass(frozen=True)
class Conditions:
    """Of n recordings at the P phases of a protocol.

    Attributes:
        level: Standard error of the mean speed of a phase without failed samples, over the speed; shape (n,).
        errors: Own and shared errors at each phase, with its own number of failed samples; (n, P), (n, P, R).
        measured: Which phases were measured; shape (n, P).
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
    repeats and samples have the ratio that they have in the protocol; no repeat fails as a whole.
    """
    low, high = np.log(settings.relative_se)
    level = np.exp(rng.uniform(low, high, number))
    lost = protocol.failed_fraction + protocol.outlier_fraction
    counts = rng.binomial(
        protocol.samples_per_repeat, 1.0 - lost, (number, protocol.phases, protocol.repeats)
    )
    flat = mean_errors(np.maximum(counts, 1).reshape(-1, protocol.repeats), _unit(protocol))
    whole, shape = _whole_phase_se(protocol), (number, protocol.phases)
    errors = MeanErrors(
        level[:, None] * (flat.own.reshape(shape) / whole),
        level[:, None, None] * (flat.shared.reshape(*shape, flat.shared.shape[1]) / whole),
    )
    return Conditions(level, errors, _draw_measured(number, settings, recording, rng))


def _unit(protocol: AcquisitionSettings) -> NoiseComponents:
    """Return the noise components that the protocol itself has."""
    return NoiseComponents(protocol.repeat_sd_fraction, protocol.sample_sd_fraction, protocol.sweep_fraction)


def _whole_phase_se(protocol: AcquisitionSettings) -> float:
    """Return the relative standard error that it gives the mean speed of a phase without failed samples."""
    whole = np.full((1, protocol.repeats), protocol.samples_per_repeat)
    return float(relative_se(whole, _unit(protocol))[0])


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


def _longest_run(missing: BoolArray) -> IntArray:
    """Return the longest run of missing phases around the cycle; shape (n,)."""
    twice = np.concatenate([missing, missing], axis=1)
    position = np.arange(twice.shape[1])
    latest = np.maximum.accumulate(np.where(twice, -1, position), axis=1)
    return np.asarray((position - latest)[:, missing.shape[1] :].max(axis=1))


class FreshSettings(Settings):
    """Where fresh recordings come from."""

    population: PopulationSettings
    conditions: ConditionSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    model: SpeedModelSettings


@dataclass(frozen=True)
class FreshSubject:
    """A context drawn from the population, and the conditions under which it is recorded.

    Attributes:
        model: The model of its recording; the speeds in it are placeholders.
        level: Standard error of the mean speed of a phase without failed samples, over the speed.
        missing: Indices of the phases that are missed.
    """

    model: SpeedModel
    level: float
    missing: tuple[int, ...]

    @property
    def context(self) -> Context:
        """The context."""
        return self.model.recording.context


def fresh_subject(index: int, settings: FreshSettings, seed: int, name: str) -> FreshSubject:
    """Draw the context and conditions with this number of the stream ``name``; never one trained on.

    Raises:
        ValueError: Its reference beat does not become periodic.
    """
    context = draw_contexts([index], settings.population, seed, "fresh", name)[0]
    rng = generator(seed, "population conditions", name, index)
    drawn = draw_conditions(1, settings.conditions, settings.acquisition, settings.recording, rng)
    measured = drawn.measured[0]
    recording = SpeedRecording(
        context=context,
        phase=nominal_phases(settings.acquisition.phases)[measured],
        speed_m_s=np.ones(int(measured.sum())),
        relative_se=drawn.errors.own[0, measured],
        shared=drawn.errors.shared[0, measured],
    )
    missing = tuple(np.flatnonzero(~measured).tolist())
    return FreshSubject(speed_model(recording, settings.model), float(drawn.level[0]), missing)


def record_fresh(
    subject: FreshSubject, kind: str, settings: FreshSettings, seed: int, *name: str | int
) -> Synthetic:
    """Draw phi and one recording of the subject, under the model's own noise or sample by sample.

    Returns:
        One recording, or none where ingestion refused it.
    """
    if kind == OWN:
        return own_recordings(subject.model, 1, seed, "population", *name)
    return acquired_recordings(subject.model, _acquisition(subject, settings), 1, seed, "population", *name)


def recorded(subject: FreshSubject, made: Synthetic) -> SpeedModel:
    """Return the model of the one recording that was made."""
    return replace(subject.model, recording=made.recordings[0])


def _acquisition(subject: FreshSubject, settings: FreshSettings) -> Acquisition:
    """Return the protocol whose whole phases have the subject's standard error."""
    protocol = settings.acquisition
    unit, factor = _unit(protocol), subject.level / _whole_phase_se(protocol)
    noise = NoiseComponents(
        factor * unit.repeat_fraction, factor * unit.sample_fraction, factor * unit.sweep_fraction
    )
    changes = {
        "repeat_sd_fraction": noise.repeat_fraction,
        "sample_sd_fraction": noise.sample_fraction,
        "sweep_fraction": noise.sweep_fraction,
    }
    return Acquisition(
        protocol.model_copy(update=changes),
        settings.recording,
        settings.model.measurement,
        noise,
        subject.missing,
    )
