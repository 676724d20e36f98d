"""Recordings under a model, those of a folder each read once, and the test of a recording's own noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.cohort.observed import UsableRecording, ingested, raw_of, read_raw, twins_among
from swesbi.recording.noise.cohort import FolderRecordings, NoiseComparison
from swesbi.recording.observation import SOURCES, Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.tables.table import Table
from swesbi.verdict.verdict import VerdictTest


@dataclass(frozen=True)
class ModelledRecording:
    """Gated phases, or pushes at instants of their own, under the model of an experiment.

    ``tests`` of the recording alone can make the subject doubtful. ``noise`` says from which its standard
    errors are estimated, and ``stream`` begins the names of the random streams of its answer.
    """

    observation: Observation
    model: SpeedModel
    tests: tuple[VerdictTest, ...] = ()
    noise: str = ""
    stream: str = "new subject"

    @property
    def has_pressures(self) -> bool:
        """Whether the pressures of a cuff can inform its posterior; those of pushes do not."""
        return self.observation.is_gated and self.observation.clinical.has_pressures


def modelled_pushes(observed: Observation, settings: SpeedModelSettings) -> ModelledRecording:
    """Return pushes under a model, with the errors that their table or its description states."""
    median = 100.0 * float(np.median(observed.relative_se))
    noise = f"{SOURCES[observed.errors_from]}, {median:.1f} % in the median"
    return ModelledRecording(
        observed, SpeedModel(measured_speeds(observed), settings), (), noise, "free subject"
    )


def noise_test(
    comparison: NoiseComparison | None, noise: NoiseComponents, whose: str, level: float
) -> VerdictTest:
    """Return the test that a recording has the noise from which its standard errors are estimated.

    The comparison is None where no other recording is like it. ``whose`` says in words what the noise is of
    ("the cohort").
    """
    if comparison is None or np.isnan(comparison.p_value):
        alone = f"the recording alone does not tell its noise, and that of {whose} is used"
        why = "no other recording of the same kind is in the folder" if comparison is None else alone
        return VerdictTest("noise", 0.0, None, level, flagged=False, detail=f"not tested: {why}")
    return VerdictTest(
        name="noise",
        statistic=comparison.statistic,
        p_value=comparison.p_value,
        threshold=level,
        flagged=comparison.p_value <= level,
        detail=_noise_in_words(comparison.own, noise, whose),
    )


def _noise_in_words(own: NoiseComponents, noise: NoiseComponents, whose: str) -> str:
    words = (
        f"{own.repeat_fraction:.1%} between repeats and {own.sample_fraction:.1%} between samples; "
        f"{whose} has {noise.repeat_fraction:.1%} and {noise.sample_fraction:.1%}"
    )
    if own.sweep_fraction or noise.sweep_fraction:
        words += f"; {own.sweep_fraction:.1%} between sweeps, {noise.sweep_fraction:.1%} in {whose}"
    return words


@dataclass(frozen=True)
class Folder:
    """The recordings outside a study: by subject those that can be used, and why the others cannot be."""

    study: Study
    observed: Mapping[str, UsableRecording]
    refused: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def repeats(self) -> FolderRecordings:
        """The repeats of the gated ones, with their noise."""
        levels = {name: each.levels for name, each in self.observed.items() if each.levels is not None}
        prior, groups = self.study.config.new_subjects.noise_prior, self.study.outside.noise_groups
        return FolderRecordings(levels, prior, groups)

    def gated(
        self, observed: UsableRecording, settings: SpeedModelSettings, noise_level: float
    ) -> ModelledRecording:
        """Return a recording under a model, with the errors that the noise of the folder gives."""
        subject = observed.observation.subject
        noise = self.repeats.noise(subject)
        model = SpeedModel(measured_speeds(observed.observation, noise.components), settings)
        test = noise_test(self.repeats.compared(subject), noise.components, "the folder", noise_level)
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
    """Ingest the recording of a subject outside the study: that of its file, or a table in memory."""
    cohort, said = study.outside, study.description(subject)
    raw = read_raw(cohort.folder, subject, said) if table is None else raw_of(table, said)
    context, clinical = cohort.rows[subject].to_context(), cohort.clinical_of(subject).to_measures()
    return ingested(raw, said, context, clinical, study.config.measurement.grid_points)
