"""Reading the recordings of a folder, each once: what they show, and the noise that they have together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from swesbi.answers.gated import GatedRecording, noise_test
from swesbi.answers.settings import OneAnswerSettings
from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.checked import Checked, CheckedFree, ingested, read_raw
from swesbi.recording.folder_noise import FolderRecordings
from swesbi.recording.problems import RecordingError


@dataclass(frozen=True)
class Folder:
    """The recordings of a folder.

    Attributes:
        observed: Those that can be used, by subject.
        refused: Why the others cannot be, by subject.
        repeats: Of the gated ones, with their noise.
    """

    observed: Mapping[str, Checked | CheckedFree]
    refused: Mapping[str, str]
    repeats: FolderRecordings

    def gated(self, observed: Checked, settings: OneAnswerSettings) -> GatedRecording:
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
    observed: dict[str, Checked | CheckedFree] = {}
    refused = dict(study.new_refused)
    for subject in study.new_rows:
        try:
            observed[subject] = observe(study, subject)
        except RecordingError as error:
            refused[subject] = str(error)
    levels = {name: each.levels for name, each in observed.items() if isinstance(each, Checked)}
    prior, groups = study.config.new_subjects.noise_prior, study.new_noise_groups
    return Folder(observed, refused, FolderRecordings(levels, prior, groups))


def observe(study: Study, subject: str) -> Checked | CheckedFree:
    """Read and ingest the recording of a subject outside the study.

    Raises:
        RecordingError: It is malformed or too incomplete, or nothing tells its errors.
    """
    said = study.said_of_new(subject)
    raw = read_raw(study.new_cohort, subject, said)
    context, clinical = study.new_rows[subject].to_context(), study.outside.clinical_of(subject).to_measures()
    return ingested(raw, said, context, clinical, study.config.measurement.grid_points)
