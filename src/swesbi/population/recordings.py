"""Fresh recordings of fresh contexts, gated and free-running."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.population.conditions import draw_conditions, draw_pushes, protocol_noise, whole_phase_se
from swesbi.population.contexts import draw_contexts
from swesbi.population.settings import ConditionSettings, PopulationSettings
from swesbi.population.synthetic import (
    Acquisition,
    Synthetic,
    acquired_recordings,
    fresh_beats,
    own_recordings,
)
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.neighbours import speed_by_neighbours
from swesbi.recording.phases import cells_of, nominal_phases
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator

MODEL_NOISE: Final = "model_noise"
SAMPLE_BY_SAMPLE: Final = "sample_by_sample"
STREAMS: Final = {MODEL_NOISE: "own", SAMPLE_BY_SAMPLE: "acquired"}
"""Names of the random streams of both kinds."""


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

    The speeds in ``model`` are placeholders; ``level`` is the standard error of the mean speed of a phase
    without failed samples, over the speed; ``missing`` are the phases that are missed.
    """

    model: SpeedModel
    level: float
    missing: tuple[int, ...]


def fresh_subject(index: int, settings: FreshSettings, seed: int, name: str) -> FreshSubject:
    """Draw the context and conditions with this number of the stream ``name``; never one trained on."""
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
    return FreshSubject(SpeedModel(recording, settings.model), float(drawn.level[0]), missing)


def record_fresh(
    subject: FreshSubject, kind: str, settings: FreshSettings, seed: int, *name: str | int
) -> Synthetic:
    """Draw phi and one recording of the subject, under the model's own noise or sample by sample.

    Phases far outside their neighbours are left out of both, as they are of any recording. The result has one
    recording, or none where ingestion refused it.
    """
    if kind == MODEL_NOISE:
        made = own_recordings(subject.model, 1, seed, "population", *name)
        kept = [one.points(in_place(one, settings.recording)) for one in made.recordings]
        return replace(made, recordings=tuple(kept))
    return acquired_recordings(subject.model, _acquisition(subject, settings), 1, seed, "population", *name)


def in_place(recording: SpeedRecording, settings: RecordingSettings) -> BoolArray:
    """Tell which phases or pushes of a recording do not lie far outside their neighbours; shape (p,)."""
    error = recording.errors.total
    return np.isnan(speed_by_neighbours(recording.phase, recording.speed_m_s, error, settings))


def recorded(subject: FreshSubject, made: Synthetic) -> SpeedModel:
    """Return the model of the one recording that was made."""
    return replace(subject.model, recording=made.recordings[0])


def record_pushes(
    number: int, pushes: tuple[int, int], settings: FreshSettings, seed: int, *name: str | int
) -> tuple[SpeedModel, FloatArray]:
    """Draw context, instants, errors, phi and speeds of the free-running recording with this number.

    The number of ``pushes`` is uniform in the logarithm from the fewest to the most; those far outside their
    neighbours are left out, as they are of any recording. Phi is of shape (d,).
    """
    context = draw_contexts([number], settings.population, seed, "fresh", *name)[0]
    rng = generator(seed, "population conditions", *name, number)
    asked = settings.conditions.free_running.model_copy(update={"pushes": pushes})
    drawn = draw_pushes(1, asked, rng)
    order, count = np.argsort(drawn.phase, kind="stable"), len(drawn.phase)
    phase, se = drawn.phase[order], drawn.relative_se[order]
    cell = cells_of(phase, settings.acquisition.phases)
    blank = SpeedRecording(context, phase, np.ones(count), drawn.factor[0] * se, np.empty((count, 0)), cell)
    known = SpeedModel(blank, settings.model)
    phi, beats = fresh_beats(known, 1, seed, *name)
    speed = known.draw_speeds(known.predict_from(phi, beats), rng)[0]
    declared = float(drawn.errors_log_sd[0])
    recording = replace(blank, speed_m_s=speed, relative_se=se, errors_log_sd=declared)
    return replace(known, recording=recording.points(in_place(recording, settings.recording))), phi[0]


def _acquisition(subject: FreshSubject, settings: FreshSettings) -> Acquisition:
    """Return the protocol whose whole phases have the subject's standard error."""
    protocol = settings.acquisition
    noise = protocol_noise(protocol).times(subject.level / whole_phase_se(protocol))
    return Acquisition.with_noise(
        protocol, noise, subject.missing, settings.recording, settings.model.measurement
    )
