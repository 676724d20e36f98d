"""Synthetic recordings with known phi, under the model's own noise or acquired sample by sample."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.beats import Beats
from swesbi.forward_model.periodic import Status
from swesbi.observation.interpolation import sample_cycle, slope_cycle
from swesbi.observation.settings import MeasurementSettings
from swesbi.observation.stiffness_map import active_stiffness_map
from swesbi.parameters import SCALE
from swesbi.prior import sample
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.phases import nominal_phases
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator
from swesbi.speed_model.likelihood import draw_speeds
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.prediction import PredictedSpeeds
from swesbi.speed_model.recording import SpeedRecording, measured_speeds
from swesbi.speed_model.settings import DiscrepancySettings
from swesbi.virtual_cohort.acquisition import acquire
from swesbi.virtual_cohort.settings import AcquisitionSettings
from swesbi.virtual_cohort.truth import TruthCurve

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Synthetic:
    """Recordings of one subject with the phi that each was made with.

    Attributes:
        phi: True parameters; shape (n, 4).
        recordings: The n recordings.
        refused: Recordings that ingestion refused; they are not among the n.
    """

    phi: FloatArray
    recordings: tuple[SpeedRecording, ...]
    refused: int = 0


@dataclass(frozen=True)
class Acquisition:
    """How recordings are acquired and read: protocol, quality control, noise components, missing phases."""

    protocol: AcquisitionSettings
    recording: RecordingSettings
    measurement: MeasurementSettings
    noise: NoiseComponents
    missing_phases: tuple[int, ...]


def own_recordings(model: SpeedModel, count: int, seed: int, *name: str | int) -> Synthetic:
    """Draw phi from the prior and speeds under the model's own noise and discrepancy.

    The recordings have the phases and standard errors of the model's recording. The stream depends on
    the seed, the name and the subject; theta that fail are redrawn.
    """
    phi, beats = fresh_beats(model, count, seed, *name)
    rng = generator(seed, "synthetic", "speeds", *name, model.recording.subject)
    predicted = model.predict_from(phi[:, SCALE], beats)
    speeds = draw_speeds(predicted, model.recording.relative_se, model.settings.discrepancy, rng)
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
    for index in range(count):
        rng = generator(seed, "synthetic", "acquisition", *name, model.recording.subject, index)
        try:
            observed = _acquire(model, acquisition, phi[index], beats, index, rng)
        except RecordingError as error:
            LOGGER.info(
                "subject %s, synthetic recording %d refused: %s", model.recording.subject, index, error
            )
        else:
            kept.append(index)
            recordings.append(measured_speeds(observed, acquisition.noise))
    return Synthetic(phi[kept], tuple(recordings), count - len(kept))


def fresh_beats(model: SpeedModel, count: int, seed: int, *name: str | int) -> tuple[FloatArray, Beats]:
    """Draw phi (count, 4) from the joint prior and simulate it; failing draws are replaced by later ones."""
    rng = generator(seed, "synthetic", "phi", *name, model.recording.subject)
    phi = sample(count, model.settings.prior, rng)
    beats = model.simulate(phi)
    while (failed := np.flatnonzero(beats.status != Status.PERIODIC)).size:
        phi[failed] = sample(failed.size, model.settings.prior, rng)
        beats = model.simulate(phi)
    return phi, beats


def _acquire(
    model: SpeedModel,
    acquisition: Acquisition,
    phi: FloatArray,
    beats: Beats,
    index: int,
    rng: np.random.Generator,
) -> Observation:
    active = active_stiffness_map(model.settings.measurement.active_stiffness_map)(
        beats.active_stiffness_kpa[index]
    )
    truth = TruthCurve(beats.cycle_phase, phi[SCALE] * model.shape.shape + active)
    protocol = acquisition.protocol.model_copy(update={"missing_phases": acquisition.missing_phases})
    samples = acquire(truth, model.recording.context, protocol, rng)
    moved = _with_discrepancy(samples, truth, protocol.phases, model.settings.discrepancy, rng)
    return ingest(moved, model.recording.context, acquisition.recording, acquisition.measurement.grid_points)


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
    factor = draw_speeds(predicted, np.zeros(phases), discrepancy, rng)[0]
    return replace(samples, speed_m_s=samples.speed_m_s * factor[samples.phase_index])
