"""The study: its configuration together with the cohort that it names, and with recordings outside it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from swesbi.config.cohort import Cohort, outside_cohort, study_cohort
from swesbi.config.models import Config
from swesbi.config.read import (
    ConfigError,
    in_words,
    merged_files,
    overlay,
    parse_config,
    read_merged,
)
from swesbi.population.settings import in_declared_range
from swesbi.recording.cohort.recording_file import Description, description_of
from swesbi.recording.samples import CONFIGURED
from swesbi.recording.settings import RecordingSettings


@dataclass(frozen=True)
class Study:
    """A validated configuration, and whose recordings it is about.

    Without its folder the cohort has no subjects; trained networks answer those outside it.
    """

    config: Config
    cohort: Cohort = field(default_factory=Cohort)
    outside: Cohort = field(default_factory=Cohort)

    @property
    def subjects(self) -> tuple[str, ...]:
        """The names of the subjects that the study runs on."""
        return tuple(self.cohort.rows)

    @property
    def of_outside(self) -> Study:
        """The same study with the subjects outside it in place of its own, and their name."""
        return Study(self.config.model_copy(update={"cohort_title": self.outside.title}), self.outside)

    def subjects_of(self, experiment: str) -> tuple[str, ...]:
        """Return the subjects that an experiment lists and the study runs on, in the study's order."""
        listed = self.config.listed_subjects(experiment)
        return tuple(name for name in self.subjects if listed is None or name in listed)

    def check_subject(self, experiment: str, subject: str) -> None:
        """Check that an experiment answers a subject of the study."""
        if subject not in self.subjects_of(experiment):
            base = self.config.base_of(experiment)
            raise ConfigError(
                f"subject = {subject!r}: not one of the experiment {experiment!r}, which has "
                f"{', '.join(self.subjects_of(experiment)) or 'none'}; experiments.{base}.subjects lists them"
            )
        if reason := self.refused(experiment).get(subject):
            raise ConfigError(f"subject = {subject!r}: refused by {experiment!r}: {reason}")

    def description(self, subject: str) -> Description:
        """Return what is said of how the recording of a subject outside the study was made."""
        known = self.outside.described.get(subject)
        return known or description_of(self.outside.folder, subject, *self.settings_of_outside)

    @property
    def settings_of_outside(self) -> tuple[RecordingSettings, str]:
        """Quality control of recordings outside the study, and where their number of phases is said."""
        settings, phases = self.config.recording, self.config.new_subjects.phases
        if phases is None:
            return settings, CONFIGURED
        return settings.model_copy(update={"phases": phases}), "--phases"

    @property
    def answering_experiments(self) -> tuple[str, ...]:
        """The experiments that run and answer subjects outside the cohort, those on the cohort first."""
        config = self.config
        on_speeds = (name for name in config.experiments_run if name in config.speed_experiments)
        return (*on_speeds, *config.populations_run)

    def answered(self, experiment: str) -> tuple[str, ...]:
        """Return the subjects of an experiment: within its declared range, for one over a population."""
        refused = self.refused(experiment)
        return tuple(subject for subject in self.subjects_of(experiment) if subject not in refused)

    def with_pressures(self, experiment: str) -> tuple[str, ...]:
        """Return those of them of whom the pressures of a cuff were taken."""
        return tuple(filter(self.has_pressures, self.answered(experiment)))

    def has_pressures(self, subject: str) -> bool:
        """Tell whether the pressures of a cuff were taken of a subject."""
        return self.cohort.clinical_of(subject).to_measures().has_pressures

    def refused(self, experiment: str) -> dict[str, str]:
        """Return the subjects outside the declared range of an experiment over a population, and why."""
        if (section := self.config.population_experiments.get(experiment)) is None:
            return {}
        problems = {
            subject: in_declared_range(self.cohort.rows[subject].to_context(), section.population)
            for subject in self.subjects_of(experiment)
        }
        return {subject: "; ".join(reasons) for subject, reasons in problems.items() if reasons}

    def with_changes(self, changes: Mapping[str, Any], source: str) -> Study:
        """Return the same cohort under a configuration with other values; ``source`` names them in errors."""
        return replace(self, config=parse_config(overlay(self.config.to_plain(), changes), source))


def load_study(
    raw: Mapping[str, Any],
    source: str = "config.yaml",
    new_cohort: Path | None = None,
    files: Sequence[Path] = (),
) -> Study:
    """Validate a raw configuration and the cohort it names, before anything runs.

    Of subjects outside the cohort, in the folder ``new_cohort``, one that cannot be used does not stop the
    others. They are answered also where the study's own cohort is not there. ``files`` are those that were
    merged, for messages.
    """
    study = Study(parse_config(raw, source, files))
    if new_cohort is None or Path(study.config.cohort).is_dir():
        study = replace(study, cohort=study_cohort(study.config, source))
        _check_subjects(study, source)
        _check_reference(study, source)
    if new_cohort is None:
        return study
    return replace(study, outside=outside_cohort(new_cohort, *study.settings_of_outside))


def _check_subjects(study: Study, source: str) -> None:
    """Check that each experiment that runs has a subject of the study."""
    config = study.config
    for name in (*config.experiments_run, *config.populations_run):
        if not study.subjects_of(name):
            base, listed = config.base_of(name), config.listed_subjects(name) or ()
            raise ConfigError(
                f"{source}: experiments.{base}.subjects: none of {', '.join(listed)} is among "
                f"`subjects`, which are {', '.join(study.subjects)}. Add one to either, or leave {name!r} "
                "out of `run`"
            )


def _check_reference(study: Study, source: str) -> None:
    """Check that the group that others are compared with is one of the cohort's."""
    from swesbi.persons.cohort.cohort import reference_among

    reference = study.config.cohort_posterior.reference_group
    try:
        if reference:
            reference_among([visit.group for visit in study.cohort.visits.values()], reference)
    except ValueError as error:
        raise ConfigError(f"{source}: cohort_posterior.reference_group: {error}") from error


def context_refusal(study: Study, experiment: str, subject: str) -> str:
    """Return why the network of an experiment cannot answer for a subject's heart; empty where it can."""
    # SciPy's distributions take a while to import, and most who read the configuration ask nothing of it
    from swesbi.verdict.context import declared_refusal, refusal

    context = study.outside.rows[subject].to_context()
    populations = study.config.population_experiments
    if experiment in populations:
        return declared_refusal(context, populations[experiment].population)
    trained = [study.cohort.rows[name].to_context() for name in study.subjects_of(experiment)]
    return refusal(context, trained, study.config.new_subjects.margin_fraction)


def values_in(refusal: str) -> list[str]:
    """Return the values that a refusal lists, each with the range that it lies outside."""
    return [line[4:] for line in refusal.splitlines() if line.startswith("  - ")]


def why_in_short(refusal: str) -> str:
    """Return a refusal in a few words: of a list the values alone."""
    values = ", ".join(values_in(refusal))
    return f"does not know such a heart ({values})" if values else refusal


def study_of(
    options: argparse.Namespace, changes: Mapping[str, Any], new_cohort: Path | None = None
) -> Study:
    """Return the study of the configuration that a command is given, with what its other options change."""
    given = (options.config, options.overlay)
    raw = overlay(read_merged(*given), changes)
    return load_study(raw, in_words(*given), new_cohort, merged_files(*given))


def study_with(folder: Path, options: argparse.Namespace) -> Study:
    """Return the study with a folder of recordings as the cohort of its new subjects."""
    chosen = {} if options.phases is None else {"phases": options.phases}
    return study_of(options, {"new_subjects": chosen}, folder)
