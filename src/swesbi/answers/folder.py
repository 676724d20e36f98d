"""Reading the recordings of a folder, each once: what they show, and the noise that they have together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from swesbi.answers.recording import ModelledRecording, noise_test
from swesbi.answers.settings import OneAnswerSettings
from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.cohort.recording import UsableRecording, ingested, raw_of, read_raw, twins_among
from swesbi.recording.noise.folder import FolderRecordings
from swesbi.recording.problems import RecordingError
from swesbi.recording.tables.table import Table


@dataclass(frozen=True)
class Folder:
    """The recordings of a folder.

    Attributes:
        study: The study whose recordings outside it these are.
        observed: Those that can be used, by subject.
        refused: Why the others cannot be, by subject.
    """

    study: Study
    observed: Mapping[str, UsableRecording]
    refused: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def repeats(self) -> FolderRecordings:
        """The repeats of the gated ones, with their noise."""
        levels = {name: each.levels for name, each in self.observed.items() if each.levels is not None}
        prior, groups = self.study.config.new_subjects.noise_prior, self.study.outside.noise_groups
        return FolderRecordings(levels, prior, groups)

    def gated(self, observed: UsableRecording, settings: OneAnswerSettings) -> ModelledRecording:
        """Return a recording under a model, with the errors that the noise of the folder gives."""
        subject = observed.observation.subject
        noise = self.repeats.noise(subject)
        model = SpeedModel(measured_speeds(observed.observation, noise.components), settings.model)
        compared, level = self.repeats.compared(subject), settings.noise_level
        test = noise_test(compared, noise.components, "the folder", level)
        return ModelledRecording(observed.observation, model, (test,), noise.in_words)


def observe_folder(study: Study) -> Folder:
    """Read and ingest every recording outside the study; one that cannot be used stops no other."""
    observed: dict[str, UsableRecording] = {}
    refused = dict(study.outside.refused)
    for subject in study.outside.rows:
        try:
            observed[subject] = observe(study, subject)
        except RecordingError as error:
            refused[subject] = str(error)
    for name, problem in twins_among(observed).items():
        refused[name] = str(problem)
        del observed[name]
    return Folder(study, observed, refused)


def observe(study: Study, subject: str, table: Table | None = None) -> UsableRecording:
    """Ingest the recording of a subject outside the study: that of its file, or a table in memory.

    Raises:
        RecordingError: It is malformed or too incomplete, or nothing tells its errors.
    """
    cohort, said = study.outside, study.description(subject)
    raw = read_raw(cohort.folder, subject, said) if table is None else raw_of(table, said)
    context, clinical = cohort.rows[subject].to_context(), cohort.clinical_of(subject).to_measures()
    return ingested(raw, said, context, clinical, study.config.measurement.grid_points)
