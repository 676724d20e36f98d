"""Reading the recordings of a folder, each once: what they show, and the noise that they have together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from swesbi.answers.gated import GatedRecording, noise_test
from swesbi.answers.settings import OneAnswerSettings
from swesbi.config.new_recordings import is_free_running, noise_declared, quality_of
from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.components import RepeatLevels
from swesbi.recording.folder_noise import FolderRecordings
from swesbi.recording.free_observation import FreeObservation, ingest_free
from swesbi.recording.free_samples import read_free_samples
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.protocol import read_repeats
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED, rejection
from swesbi.recording.sweeps import levels_by


@dataclass(frozen=True)
class GatedObservation:
    """A gated recording as it was read.

    Attributes:
        observation: What quality control makes of its samples.
        levels: Its repeats, which tell its noise.
    """

    observation: Observation
    levels: RepeatLevels


@dataclass(frozen=True)
class Folder:
    """The recordings of a folder.

    Attributes:
        observed: Those that can be used, by subject.
        refused: Why the others cannot be, by subject.
        repeats: Of the gated ones, with their noise.
    """

    observed: Mapping[str, GatedObservation | FreeObservation]
    refused: Mapping[str, str]
    repeats: FolderRecordings

    def gated(self, observed: GatedObservation, settings: OneAnswerSettings) -> GatedRecording:
        """Return a recording under a model, with the errors that the noise of the folder gives."""
        subject = observed.observation.subject
        noise = self.repeats.noise(subject)
        model = SpeedModel(
            measured_speeds(observed.observation, noise.components), settings.exact_posterior.model
        )
        compared, level = self.repeats.compared(subject), settings.noise_level
        test = noise_test(compared, noise.components, "the folder", level)
        return GatedRecording(observed.observation, model, (test,), noise.in_words)


def observe_folder(study: Study) -> Folder:
    """Read and ingest every recording outside the study; one that cannot be used stops no other."""
    observed: dict[str, GatedObservation | FreeObservation] = {}
    refused = dict(study.new_refused)
    for subject in study.new_rows:
        try:
            observed[subject] = observe(study, subject)
        except RecordingError as error:
            refused[subject] = str(error)
    levels = {name: each.levels for name, each in observed.items() if isinstance(each, GatedObservation)}
    return Folder(observed, refused, FolderRecordings(levels, study.config.new_subjects.noise_prior))


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
    repeats = read_repeats(study.new_protocol, subject)
    return GatedObservation(observed, levels_by(repeats, samples, rejection(samples, settings) == ACCEPTED))
