"""Reading the recording of a subject outside the study, once."""

from __future__ import annotations

from dataclasses import dataclass

from swesbi.answers.gated import GatedRecording, noise_test
from swesbi.answers.settings import OneAnswerSettings
from swesbi.config.new_recordings import is_free_running, noise_declared, quality_of
from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.free_observation import FreeObservation, ingest_free
from swesbi.recording.free_samples import read_free_samples
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.protocol import Repeats, read_repeats
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples
from swesbi.recording.speed import NoiseComponents


@dataclass(frozen=True)
class GatedObservation:
    """A gated recording as it was read.

    Attributes:
        samples: Raw.
        observation: What quality control makes of them.
        repeats: Whether its repeats are sweeps.
    """

    samples: Samples
    observation: Observation
    repeats: Repeats

    def under(self, settings: OneAnswerSettings, noise: NoiseComponents) -> GatedRecording:
        """Return the recording under a model, with the errors that this noise gives."""
        known = known_noise(self.repeats, noise)
        model = SpeedModel(measured_speeds(self.observation, known), settings.exact_posterior.model)
        quality, level = settings.ingest.recording, settings.noise_level
        test = noise_test(self.samples, self.repeats, noise, quality, level)
        return GatedRecording(self.observation, model, (test,))


def observe(study: Study, subject: str) -> GatedObservation | FreeObservation:
    """Read and ingest the recording of a subject outside the study.

    Raises:
        RecordingError: It is malformed or too incomplete, or nothing tells its errors.
    """
    settings, layout = quality_of(study, subject), study.new_layout_of(subject)
    path, density = study.new_recording(subject), settings.density_kg_m3
    context, clinical = study.new_rows[subject].to_context(), study.outside.clinical_of(subject).to_measures()
    if is_free_running(study, subject):
        pushes = read_free_samples(path, density, layout, subject)
        return ingest_free(pushes, context, settings, noise_declared(study, subject), clinical)
    samples = read_samples(path, settings.phases, density, layout, subject)
    observed = ingest(samples, context, settings, study.config.measurement.grid_points, clinical)
    return GatedObservation(samples, observed, read_repeats(study.new_protocol, subject))


def known_noise(repeats: Repeats, pooled: NoiseComponents) -> NoiseComponents:
    """Return the pool's components as the recording has them: of sweeps only where its repeats are such."""
    return pooled if repeats == "sweeps" else pooled.of_separate_repeats
