"""The study: its configuration together with the cohort that it names."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from swesbi.config.models import Config
from swesbi.config.read import ConfigError, overlay, parse_config, read_yaml
from swesbi.population.settings import in_declared_range
from swesbi.recording.cohort.clinical import ClinicalRow
from swesbi.recording.cohort.files import PROTOCOL, SUBJECTS, check_file, find_recording
from swesbi.recording.cohort.recording_file import (
    Description,
    description_of,
    noise_groups_of,
    own_file,
    read_recording_file,
)
from swesbi.recording.cohort.subjects import SubjectTable, examine_subjects, read_subject_table
from swesbi.recording.cohort.visits import Person, Visit, persons_of
from swesbi.recording.problems import Problem, RecordingError, listed
from swesbi.recording.samples import CONFIGURED
from swesbi.recording.settings import ContextRow
from swesbi.recording.tables.layout import TableLayout

MOST_JOBS: Final = 32
"""Jobs of one kind for a cohort: enough for the cores of a cluster node, few enough that none is idle."""
FOLDER_NAME: Final = re.compile(r"[\w. -]+")
NEW_COHORT: Final = "recordings"
"""What messages call the folder of recordings outside the cohort."""


@dataclass(frozen=True)
class Study:
    """A validated configuration and the context row of each subject, in the cohort's order.

    Attributes:
        config: The configuration.
        context_rows: Subjects of the cohort that the study runs on.
        new_rows: Subjects outside it, which trained networks answer.
        clinical_rows: What was measured of all these beside the speeds.
        new_clinical_rows: The same of those outside.
        visit_rows: Whose recordings these are.
        new_visit_rows: The same of those outside, the refused ones included.
        layout: How the cohort's tables differ from this project's form.
        new_layout: The same of those outside.
        noise_groups: The group of each subject whose errors are estimated apart from those of the others.
        new_noise_groups: The same of those outside.
        new_refused: Those outside whose row or recording cannot be used, and why; they have no row here.
        new_cohort: The folder of the recordings of those outside.
        new_recordings: The file of each of those outside.
        new_described: How those of them were made that are in memory.
    """

    config: Config
    context_rows: Mapping[str, ContextRow]
    new_rows: Mapping[str, ContextRow] = field(default_factory=dict)
    clinical_rows: Mapping[str, ClinicalRow] = field(default_factory=dict)
    new_clinical_rows: Mapping[str, ClinicalRow] = field(default_factory=dict)
    visit_rows: Mapping[str, Visit] = field(default_factory=dict)
    new_visit_rows: Mapping[str, Visit] = field(default_factory=dict)
    layout: TableLayout = field(default_factory=TableLayout)
    new_layout: TableLayout = field(default_factory=TableLayout)
    noise_groups: Mapping[str, str] = field(default_factory=dict)
    new_noise_groups: Mapping[str, str] = field(default_factory=dict)
    new_refused: Mapping[str, str] = field(default_factory=dict)
    new_cohort: Path = Path()
    new_recordings: Mapping[str, Path] = field(default_factory=dict)
    new_described: Mapping[str, Description] = field(default_factory=dict)

    @property
    def subjects(self) -> tuple[str, ...]:
        """The subjects' names."""
        return tuple(self.context_rows)

    def clinical_of(self, subject: str) -> ClinicalRow:
        """Return what was measured of a subject beside the speeds."""
        return self.clinical_rows.get(subject, ClinicalRow())

    @property
    def visits(self) -> Mapping[str, Visit]:
        """Whose recording each subject of the study is, in the order of the table: that of the visits."""
        told = {subject: visit for subject, visit in self.visit_rows.items() if subject in self.context_rows}
        return told | {subject: Visit() for subject in self.subjects if subject not in told}

    @property
    def persons(self) -> tuple[Person, ...]:
        """The persons of the study, each with those of their visits that the study runs on."""
        return persons_of(self.visits)

    @property
    def outside(self) -> Study:
        """The same study with the subjects outside it in place of its own."""
        return replace(
            self,
            context_rows=self.new_rows,
            clinical_rows=self.new_clinical_rows,
            visit_rows=self.new_visit_rows,
            layout=self.new_layout,
        )

    def subjects_of(self, experiment: str) -> tuple[str, ...]:
        """Return the subjects that an experiment lists and the study runs on, in the study's order."""
        listed = self.config.listed_subjects(experiment)
        return tuple(name for name in self.subjects if listed is None or name in listed)

    def check_subject(self, experiment: str, subject: str) -> None:
        """Check that an experiment answers a subject of the study.

        Raises:
            ConfigError: It does not have the subject, or refuses it.
        """
        if subject not in self.subjects_of(experiment):
            base = self.config.base_of(experiment)
            raise ConfigError(
                f"subject = {subject!r}: not one of the experiment {experiment!r}, which has "
                f"{', '.join(self.subjects_of(experiment)) or 'none'}; experiments.{base}.subjects lists them"
            )
        refused = self.refused(experiment) if experiment in self.config.population_experiments else {}
        if subject in refused:
            raise ConfigError(f"subject = {subject!r}: refused by {experiment!r}: {refused[subject]}")

    @property
    def cohort(self) -> Path:
        """The cohort's folder."""
        return Path(self.config.cohort)

    def recording(self, subject: str) -> Path:
        """Return the path of a subject's raw samples, CSV or .mat.

        Raises:
            RecordingError: There is no such file, more than one, or it leads out of the cohort.
        """
        return find_recording(self.cohort, subject, self.layout.table.file)

    def said_of_new(self, subject: str) -> Description:
        """Return what is said of how the recording of a subject outside the cohort was made.

        Raises:
            RecordingError: A file cannot be used, or says otherwise than the configuration.
        """
        if subject in self.new_described:
            return self.new_described[subject]
        phases = self.config.new_subjects.phases or self.config.recording.phases
        settings = self.config.recording.model_copy(update={"phases": phases})
        where = CONFIGURED if self.config.new_subjects.phases is None else "--phases"
        return description_of(self.new_cohort, subject, settings, where)

    @property
    def new_cohort_name(self) -> str:
        """The name of the folder of the recordings outside the cohort, under which the answers lie."""
        return self.new_cohort.resolve().name

    @property
    def answering_experiments(self) -> tuple[str, ...]:
        """The experiments that run and answer subjects outside the cohort, those on the cohort first."""
        config = self.config
        on_speeds = (name for name in config.experiments_run if name in config.speed_experiments)
        return (*on_speeds, *config.populations_run)

    def answered(self, experiment: str) -> tuple[str, ...]:
        """Return the subjects within the declared range of an experiment over a population."""
        refused = self.refused(experiment)
        return tuple(subject for subject in self.subjects_of(experiment) if subject not in refused)

    def with_pressures(self, experiment: str) -> tuple[str, ...]:
        """Return those of them of whom the pressures of a cuff were taken."""
        measured = {name: self.clinical_of(name).to_measures() for name in self.answered(experiment)}
        return tuple(name for name, clinical in measured.items() if clinical.has_pressures)

    def refused(self, experiment: str) -> dict[str, str]:
        """Return the subjects outside the declared range of an experiment over a population, and why."""
        population = self.config.population_experiments[experiment].population
        problems = {
            subject: in_declared_range(self.context_rows[subject].to_context(), population)
            for subject in self.subjects_of(experiment)
        }
        return {subject: "; ".join(reasons) for subject, reasons in problems.items() if reasons}

    def batches(self, subjects: Sequence[str]) -> tuple[tuple[str, ...], ...]:
        """Share subjects out, in order, over the jobs of a light stage: one to each unless there are many."""
        size = self.config.resources.subjects_per_job or max(-(-len(subjects) // MOST_JOBS), 1)
        return tuple(tuple(subjects[start : start + size]) for start in range(0, len(subjects), size))

    def with_changes(self, changes: Mapping[str, Any], source: str) -> Study:
        """Return the same cohort under a configuration with other values; ``source`` names them in errors.

        Raises:
            ConfigError: The changed configuration is not valid.
        """
        return replace(self, config=parse_config(overlay(self.config.to_plain(), changes), source))


OWN_PROTOCOL: Final = "says how one recording was made, but networks learn from a cohort of one protocol"
ONE_PROTOCOL: Final = "leave the subject out of `subjects` and ask `swesbi infer`, or remove the file"


def load_study(
    raw: Mapping[str, Any],
    source: str = "config.yaml",
    new_cohort: Path | None = None,
    files: Sequence[Path] = (),
) -> Study:
    """Validate a raw configuration and the cohort it names, before anything runs.

    Of subjects outside the cohort, one that cannot be used does not stop the others. They are answered also
    where the study's own cohort is not there.

    Args:
        raw: The configuration.
        source: Where it stands, for messages.
        new_cohort: Folder of recordings outside the cohort, as ``--cohort`` of a command names it.
        files: Those that were merged, for messages.

    Raises:
        ConfigError: The configuration, the table of subjects, or a subject's file is missing or wrong.
    """
    for path in files:
        read_yaml(path)  # Snakemake, which has merged them, takes the last of two equal keys
    config = parse_config(raw, source, files)
    if new_cohort is not None and not Path(config.cohort).is_dir():
        return _with_new_subjects(Study(config, {}), new_cohort)
    table = _read_table(config.cohort, f"{source}: cohort")
    rows = _select(config, table.rows, source)
    layout, groups = _check_protocol(Path(config.cohort), f"{source}: cohort", table.names)
    study = Study(
        config,
        rows,
        clinical_rows=table.clinical,
        visit_rows=table.visits,
        layout=layout,
        noise_groups=groups,
    )
    _check_lists(study, table.rows, source)
    _check_files(study, f"{source}: cohort")
    return study if new_cohort is None else _with_new_subjects(study, new_cohort)


def _with_new_subjects(study: Study, cohort: Path) -> Study:
    """Return the study with the subjects of another folder, those that cannot be used apart."""
    if not FOLDER_NAME.fullmatch(cohort.resolve().name):
        raise ConfigError(
            f"{NEW_COHORT} = {str(cohort)!r}: answers lie in a folder of its name, which may have "
            "letters, digits, spaces and . _ - alone; rename it"
        )
    new = _read_table(str(cohort), NEW_COHORT, examine_subjects)
    layout, groups = _check_protocol(cohort, NEW_COHORT, new.names)
    refused, files = dict(new.refused), {}
    of_folder = replace(study, new_cohort=cohort)
    for subject in new.rows:
        try:
            own = own_file(cohort, subject).exists()
            chosen = of_folder.said_of_new(subject).file.layout if own else layout
            files[subject] = find_recording(cohort, subject, chosen.table.file)
        except RecordingError as error:
            refused.setdefault(subject, str(error))
    usable = [subject for subject in new.rows if subject not in refused]
    return replace(
        study,
        new_rows={subject: new.rows[subject] for subject in usable},
        new_clinical_rows={subject: new.clinical[subject] for subject in usable},
        new_visit_rows=new.visits,
        new_layout=layout,
        new_noise_groups=groups,
        new_refused=refused,
        new_cohort=cohort,
        new_recordings={subject: files[subject] for subject in usable},
    )


def _read_table(
    cohort: str, key: str, read: Callable[[Path], SubjectTable] = read_subject_table
) -> SubjectTable:
    table = Path(cohort) / SUBJECTS
    try:
        check_file(table, table.parent)
        return read(table)
    except RecordingError as error:
        absent = "" if Path(cohort).is_dir() else "there is no such folder; "
        raise ConfigError(f"{key} = {cohort!r}: {absent}{error}") from error


def _select(config: Config, known: Mapping[str, ContextRow], source: str) -> dict[str, ContextRow]:
    names = tuple(known) if config.subjects == "all" else config.subjects
    if unknown := [name for name in names if name not in known]:
        raise ConfigError(
            f"{source}: subjects: {unknown[0]!r} has no row in {Path(config.cohort) / SUBJECTS}; "
            f"it knows {', '.join(known)}. "
            "Add the row, or remove the subject"
        )
    if len(set(names)) < len(names) or not names:
        raise ConfigError(f"{source}: subjects = {list(names)}: name at least one subject, each once")
    return {name: known[name] for name in names}


def _check_lists(study: Study, known: Mapping[str, ContextRow], source: str) -> None:
    """Check that experiments list subjects of the cohort, and that each that runs has one of the study."""
    config = study.config
    for name in config.experiments:
        if unknown := [each for each in config.listed_subjects(name) or () if each not in known]:
            raise ConfigError(
                f"{source}: experiments.{name}.subjects: {unknown[0]!r} has no row in "
                f"{Path(config.cohort) / SUBJECTS}; it knows {', '.join(known)}. "
                f"Correct the list, or write experiments.{name}.subjects: all"
            )
    for name in (*config.experiments_run, *config.populations_run):
        if not study.subjects_of(name):
            base, listed = config.base_of(name), config.listed_subjects(name) or ()
            raise ConfigError(
                f"{source}: experiments.{base}.subjects: none of {', '.join(listed)} is among "
                f"`subjects`, which are {', '.join(study.subjects)}. Add one to either, or leave {name!r} "
                "out of `run`"
            )


def _check_protocol(cohort: Path, key: str, subjects: Collection[str]) -> tuple[TableLayout, dict[str, str]]:
    """Return how a cohort's tables differ, and which recordings have errors of their own.

    Its ``recording.yaml`` must be there and say so plainly.
    """
    try:
        file = read_recording_file(cohort)
        return file.layout, noise_groups_of(file, cohort / PROTOCOL, subjects)
    except RecordingError as error:
        raise ConfigError(f"{key} = {str(cohort)!r}: {error}") from error


def _check_files(study: Study, key: str) -> None:
    problems: list[Problem] = []
    for subject in study.subjects:
        try:
            study.recording(subject)
        except RecordingError as error:
            problems.extend(error.problems)
        if (own := own_file(study.cohort, subject)).exists():
            problems.append(Problem(str(own), OWN_PROTOCOL, ONE_PROTOCOL))
    if problems:
        raise ConfigError(f"{key} = {str(study.cohort)!r}: {listed(problems)}")
