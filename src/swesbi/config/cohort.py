"""A folder of recordings: who was recorded, what is known of them, and where the recordings lie."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from swesbi.config.models import Config
from swesbi.config.read import ConfigError
from swesbi.recording.cohort.clinical import ClinicalRow
from swesbi.recording.cohort.files import RECORDING_FILE, SUBJECTS, check_file, find_recording
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
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.recording.tables.layout import TableLayout

OUTSIDE: Final = "recordings"
"""What messages call the folder of recordings outside the study's cohort."""


@dataclass(frozen=True)
class Cohort:
    """The subjects of a folder, in the order of its table.

    ``declared_visits`` are those of the table, also of who is refused; who is refused has no row here.
    ``layout`` is how the tables differ from this project's form. Errors are estimated apart for each of
    ``noise_groups``. ``files`` has the recordings that are known already, ``described`` how those in memory
    were made.
    """

    folder: Path = Path()
    rows: Mapping[str, ContextRow] = field(default_factory=dict)
    clinical: Mapping[str, ClinicalRow] = field(default_factory=dict)
    declared_visits: Mapping[str, Visit] = field(default_factory=dict)
    layout: TableLayout = field(default_factory=TableLayout)
    noise_groups: Mapping[str, str] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)
    described: Mapping[str, Description] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """What figures call the subjects: the name of their folder."""
        return "recordings in memory" if self.described else self.folder.resolve().name

    def clinical_of(self, subject: str) -> ClinicalRow:
        """Return what was measured of a subject beside the speeds."""
        return self.clinical.get(subject, ClinicalRow())

    @property
    def visits(self) -> Mapping[str, Visit]:
        """Whose recording each subject is, in the order of the table: that of the visits."""
        told = {subject: visit for subject, visit in self.declared_visits.items() if subject in self.rows}
        return told | {subject: Visit() for subject in self.rows if subject not in told}

    @property
    def persons(self) -> tuple[Person, ...]:
        """The persons, each with those of their visits that are used."""
        return persons_of(self.visits)

    def recording(self, subject: str) -> Path:
        """Return the path of a subject's raw samples, CSV or .mat."""
        return find_recording(self.folder, subject, self.layout.table.file)


def study_cohort(config: Config, source: str) -> Cohort:
    """Return the subjects that a study runs on; every row of its cohort's table must be right.

    ``source`` is where the configuration stands, for messages.
    """
    folder, key = Path(config.cohort), f"{source}: cohort"
    table, layout, groups = _read_folder(folder, key, read_subject_table)
    for listing, names in config.subject_lists.items():
        if unknown := [name for name in names if name not in table.rows]:
            raise ConfigError(
                f"{source}: {listing}: {unknown[0]!r} has no row in {folder / SUBJECTS}; it knows "
                f"{', '.join(table.rows)}. Add the row, correct the list, or write {listing}: all"
            )
    rows = {name: table.rows[name] for name in config.subject_lists.get("subjects", table.rows)}
    cohort = Cohort(folder, rows, table.clinical, table.visits, layout, groups)
    problems: list[Problem] = []
    for subject in rows:
        try:
            cohort.recording(subject)
        except RecordingError as error:
            problems.extend(error.problems)
        if (own := own_file(folder, subject)).exists():
            reason = "says how one recording was made, but networks learn from a cohort of one protocol"
            remedy = "leave the subject out of `subjects` and ask `swesbi infer`, or remove the file"
            problems.append(Problem(str(own), reason, remedy))
    if problems:
        raise ConfigError(f"{key} = {str(folder)!r}: {listed(problems)}")
    return cohort


def outside_cohort(folder: Path, settings: RecordingSettings, phases_source: str) -> Cohort:
    """Return the subjects of a folder outside the study; one that cannot be used stops no other.

    The settings are of recordings that do not say otherwise; ``phases_source`` is where their number of
    phases is said, for messages.
    """
    if not re.fullmatch(r"[\w. -]+", folder.resolve().name):
        raise ConfigError(
            f"{OUTSIDE} = {str(folder)!r}: answers lie in a folder of its name, which may have "
            "letters, digits, spaces and . _ - alone; rename it"
        )
    table, layout, groups = _read_folder(folder, OUTSIDE, examine_subjects)
    refused, files = dict(table.refused), {}
    for subject in [name for name in table.rows if name not in refused]:
        try:
            own = own_file(folder, subject).exists()
            chosen = description_of(folder, subject, settings, phases_source).file.layout if own else layout
            files[subject] = find_recording(folder, subject, chosen.table.file)
        except RecordingError as error:
            refused[subject] = str(error)
    rows = {subject: row for subject, row in table.rows.items() if subject not in refused}
    return Cohort(folder, rows, table.clinical, table.visits, layout, groups, refused, files)


def _read_folder(
    folder: Path, key: str, read: Callable[[Path], SubjectTable]
) -> tuple[SubjectTable, TableLayout, dict[str, str]]:
    """Return a folder's table, how its tables differ, and which recordings have errors of their own."""
    try:
        check_file(folder / SUBJECTS, folder)
        table, file = read(folder / SUBJECTS), read_recording_file(folder)
        return table, file.layout, noise_groups_of(file, folder / RECORDING_FILE, table.names)
    except RecordingError as error:
        absent = "" if folder.is_dir() else "there is no such folder; "
        raise ConfigError(f"{key} = {str(folder)!r}: {absent}{error}") from error
