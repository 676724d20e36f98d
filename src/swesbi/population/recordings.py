"""Synthetic recordings with known parameters: of one subject, or of fresh contexts, gated and free-running.

They are drawn under the model's own noise, or acquired sample by sample.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.settings import Settings
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import MAXIMUM_ATTEMPTS, SimulationFailure
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import MeasuredSubject, SpeedModel, SpeedModelSettings, draw_speeds
from swesbi.measurement.operator import PassiveBaseline, calibrate_passive, total_cycle
from swesbi.measurement.settings import (
    DiscrepancySettings,
    MeasurementSettings,
    PassiveSettings,
    SummarySettings,
)
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording, measured_speeds
from swesbi.measurement.summary import summarise
from swesbi.population.conditions import draw_conditions, draw_pushes, protocol_noise, whole_phase_se
from swesbi.population.contexts import draw_contexts
from swesbi.population.settings import ConditionSettings, PopulationSettings
from swesbi.prior import sample
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.errors import MeanErrors
from swesbi.recording.observation import Observation
from swesbi.recording.phases import cells_of, nominal_phases, sample_cycle, slope_cycle, to_grid
from swesbi.recording.problems import RecordingError
from swesbi.recording.quality import speed_by_neighbours
from swesbi.recording.samples import Samples
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator

LOGGER = logging.getLogger("swesbi")
MODEL_NOISE: Final = "model_noise"
SAMPLE_BY_SAMPLE: Final = "sample_by_sample"
STREAMS: Final = {MODEL_NOISE: "own", SAMPLE_BY_SAMPLE: "acquired"}
"""Names of the random streams of both kinds."""


@dataclass(frozen=True)
class Synthetic:
    """Recordings of one subject, n of them, with the phi (n, d) of each; those refused are not among them."""

    phi: FloatArray
    recordings: tuple[SpeedRecording, ...]


@dataclass(frozen=True)
class Acquisition:
    """How recordings are acquired and read: protocol, quality control, noise components."""

    settings: AcquisitionSettings
    recording: RecordingSettings
    measurement: MeasurementSettings
    noise: NoiseComponents

    @classmethod
    def with_noise(
        cls,
        protocol: AcquisitionSettings,
        noise: NoiseComponents,
        missing_phases: tuple[int, ...],
        recording: RecordingSettings,
        measurement: MeasurementSettings,
    ) -> Acquisition:
        """Return a protocol with other errors than its own, which ingestion takes as known.

        It has no scale error: one scale of all speeds is a parameter of phi, and in the truth already where
        it is free.
        """
        changes = {
            "sample_sd_fraction": noise.sample_fraction,
            "repeat_sd_fraction": noise.repeat_fraction,
            "sweep_fraction": noise.sweep_fraction,
            "scale_fraction": 0.0,
            "missing_phases": missing_phases,
        }
        return cls(protocol.model_copy(update=changes), recording, measurement, noise)


def own_recordings(model: SpeedModel, count: int, seed: int, *name: str | int) -> Synthetic:
    """Draw phi from the prior and speeds under the model's own noise and discrepancy.

    The recordings have the phases and errors of the model's recording. The stream depends on the seed, the
    name and the subject; theta that fail are redrawn.
    """
    phi, beats = fresh_beats(model, count, seed, *name)
    rng = generator(seed, "synthetic", "speeds", *name, model.recording.subject)
    predicted = model.predict_from(phi, beats)
    speeds = draw_speeds(predicted, model.recording.errors, model.settings.discrepancy, rng)
    return Synthetic(phi, tuple(replace(model.recording, speed_m_s=row) for row in speeds))


def acquired_recordings(
    model: SpeedModel, acquisition: Acquisition, count: int, seed: int, *name: str | int
) -> Synthetic:
    """Draw the same phi, and record each sample by sample: discrepancy, noise, failures, ingestion.

    The model's discrepancy is drawn once for each phase of a recording and moves all its samples; what
    ingestion makes of them has phases, standard errors and missing phases of its own.
    """
    phi, beats = fresh_beats(model, count, seed, *name)
    kept: list[int] = []
    recordings: list[SpeedRecording] = []
    stiffness = model.stiffness(phi, beats)
    for index in range(count):
        rng = generator(seed, "synthetic", "acquisition", *name, model.recording.subject, index)
        try:
            observed = _acquire(model, acquisition, TruthCurve(beats.cycle_phase, stiffness[index]), rng)
        except RecordingError as error:
            LOGGER.info(
                "subject %s, synthetic recording %d refused: %s", model.recording.subject, index, error
            )
        else:
            kept.append(index)
            recordings.append(measured_speeds(observed, acquisition.noise))
    return Synthetic(phi[kept], tuple(recordings))


def fresh_beats(model: SpeedModel, count: int, seed: int, *name: str | int) -> tuple[FloatArray, Beats]:
    """Draw phi (count, d) from the joint prior and simulate it; failing draws are replaced by later ones."""
    subject, prior = model.recording.subject, model.settings.prior
    rng = generator(seed, "synthetic", "phi", *name, subject)
    phi, failed = np.empty((count, len(prior.parameters))), np.arange(count)
    for _ in range(MAXIMUM_ATTEMPTS):
        phi[failed] = sample(failed.size, prior, rng)
        beats = model.simulate(phi)
        failed = np.flatnonzero(beats.status != Status.PERIODIC)
        if not failed.size:
            return phi, beats
    raise SimulationFailure(
        f"subject {subject}: {MAXIMUM_ATTEMPTS} draws in a row gave no periodic beat "
        f"({Status(beats.status[failed[0]]).name.lower()}); the last phi was {phi[failed[0]].tolist()}. "
        "Narrow the prior's bounds or check the subject's context."
    )


def _acquire(
    model: SpeedModel, acquisition: Acquisition, truth: TruthCurve, rng: np.random.Generator
) -> Observation:
    context, phases = model.recording.context, acquisition.settings.phases
    samples = acquire(truth, context, acquisition.settings, rng)
    moved = _with_discrepancy(samples, truth, phases, model.settings.discrepancy, rng)
    return ingest(moved, context, acquisition.recording, acquisition.measurement.grid_points)


def _with_discrepancy(
    samples: Samples,
    truth: TruthCurve,
    phases: int,
    discrepancy: DiscrepancySettings,
    rng: np.random.Generator,
) -> Samples:
    """Multiply the samples of each phase by one draw of exp(delta + tau d log c / ds)."""
    at = nominal_phases(phases)
    stiffness = sample_cycle(truth.cycle_phase, truth.stiffness_kpa[None], at)
    slope = 0.5 * slope_cycle(truth.cycle_phase, truth.stiffness_kpa[None], at) / stiffness
    predicted = PredictedSpeeds(np.zeros_like(slope), slope)
    factor = draw_speeds(predicted, MeanErrors.separate(np.zeros(phases)), discrepancy, rng)[0]
    return replace(samples, speed_m_s=samples.speed_m_s * factor[samples.phase_index])


@dataclass(frozen=True)
class Reacquisition:
    """What one subject's recordings are made and read with.

    ``reference`` is one beat in the subject's context, on which the passive baseline is calibrated.
    """

    subject: MeasuredSubject
    reference: Beats
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    passive: PassiveSettings
    measurement: MeasurementSettings
    summary: SummarySettings

    def features(
        self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Record the curve of one active stiffness (M,) and return its features, shape (F,).

        The recording takes its passive baseline from itself, as every recording of the study does; the
        estimator knows the subject's first baseline, so the recording is moved to it. A recording may be
        refused.
        """
        true_passive, observed_at = self.subject.passive, self.subject.observation
        truth = total_cycle((cycle_phase, active_stiffness_kpa[None]), true_passive, self.measurement)[0]
        missing = tuple(int(index) for index in observed_at.phase_index[~observed_at.measured])
        settings = self.acquisition.model_copy(update={"missing_phases": missing})
        samples = acquire(TruthCurve(cycle_phase, truth), observed_at.context, settings, rng)
        recorded = ingest(samples, observed_at.context, self.recording, self.measurement.grid_points)
        calibrated = calibrate_passive(recorded, self.reference, self.passive, self.measurement)
        return features_under(true_passive, recorded, calibrated, self.measurement, self.summary)


def features_under(
    trained: PassiveBaseline,
    recorded: Observation,
    calibrated: PassiveBaseline,
    measurement: MeasurementSettings,
    summary: SummarySettings,
) -> FloatArray:
    """Return the features (F,) of a recording, moved from its own passive baseline to that of the training.

    An estimator knows each subject under one passive baseline. A recording with another is moved by the
    difference of the two at its phases, which is what training under the new one would amount to:
    E_obs - E_pass is compared with E_act in both.
    """
    phase = recorded.measured_phase
    move = trained.stiffness_kpa - calibrated.stiffness_kpa
    at_phases = sample_cycle(trained.cycle_phase, move[None], phase)[0]
    moved = recorded.stiffness_kpa[recorded.measured] + at_phases
    features: FloatArray = summarise(to_grid(phase, moved[None], measurement.grid_points), summary)[0]
    return features


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
