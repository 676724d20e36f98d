"""Checking a cohort before anything runs on it: every problem of every file, or what it comes to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from swesbi.recording.cohort.files import RECORDING_FILE, RECORDINGS, SUBJECTS, check_file
from swesbi.recording.cohort.observed import UsableRecording, ingested, read_raw, twins_among
from swesbi.recording.cohort.recording_file import (
    Description,
    RecordingFile,
    description_of,
    noise_groups_of,
    own_file,
)
from swesbi.recording.cohort.subjects import SubjectTable, examine_subjects
from swesbi.recording.cohort.visits import Visit, persons_in_words
from swesbi.recording.noise.cohort import together
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.observation import SOURCES, Observation
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.samples import CONFIGURED
from swesbi.recording.settings import RecordingSettings, is_subject
from swesbi.recording.tables.files import SUFFIXES, open_table
from swesbi.recording.tables.layout import SUBJECT, TableLayout

Value = TypeVar("Value")
HEADER: Final = (
    "subject",
    "phases",
    "accepted",
    "rejected",
    "SE of c_s",
    "largest",
    "repeats",
    "samples",
    "E (kPa)",
    "rejected, by reason",
)
FREE_HEADER: Final = ("subject", "pushes", "rejected", "beats", "SE of c_s", "E (kPa)", "errors")
FREE_LEGEND: Final = (
    "Free-running: pushes: accepted, each at an instant of its own. beats: that they lie in.\n"
    "SE of c_s: relative standard error of a speed, median; errors: what it is estimated from."
)
LEGEND: Final = (
    "phases: measured of gated. SE of c_s: standard error of a phase's mean shear-wave speed, median and\n"
    "largest. repeats, samples: relative standard deviation between repeats, and between samples of one.\n"
    "E: apparent Young's modulus of the measured phases, lowest to highest."
)


@dataclass(frozen=True)
class CohortReport:
    """What a cohort holds: the subjects without a problem, in the table's order, and all problems.

    ``origin`` is where the recordings come from, empty if the cohort does not say. ``notes`` say which files,
    rows of a table of all, and columns of ``subjects.csv`` are not used. ``visits`` say, by subject, whose
    recordings those of the table are.
    """

    subjects: tuple[UsableRecording, ...]
    origin: str
    problems: tuple[Problem, ...]
    notes: tuple[str, ...]
    visits: Mapping[str, Visit] = field(default_factory=dict)

    @property
    def usable(self) -> tuple[str, ...]:
        """Names of all without a problem."""
        return tuple(one.observation.subject for one in self.subjects)

    @property
    def free_running(self) -> tuple[str, ...]:
        """Names of those of them whose recordings are free-running."""
        return tuple(one.observation.subject for one in self.subjects if not one.observation.is_gated)


def examine_cohort(
    cohort: Path, settings: RecordingSettings, grid_points: int, phases_source: str = CONFIGURED
) -> CohortReport:
    """Check every file of a cohort, and ingest every recording, without writing anything.

    The cohort is a folder with ``subjects.csv``, ``recording.yaml`` and ``swe/``. Grids have ``grid_points``;
    ``phases_source`` is where the number of phases is said, for messages.
    """
    if not cohort.is_dir():
        absent = Problem(str(cohort), "is no folder", "correct the path; `template` starts a new cohort")
        return CohortReport((), "", (absent,), ())
    problems: list[Problem] = []
    table = _collect(problems, partial(_subjects, cohort)) or SubjectTable(_recorded(cohort), {}, {}, {}, ())
    problems.extend(table.problems)
    described = partial(description_of, cohort, settings=settings, phases_source=phases_source)
    said = _collect(problems, partial(described, "")) or Description(settings, RecordingFile(), phases_source)
    _collect(problems, partial(noise_groups_of, said.file, cohort / RECORDING_FILE, table.names))
    check = partial(_check, cohort, said, described, table=table, grid_points=grid_points)
    checked = [_collect(problems, partial(check, name)) for name in table.names]
    usable = {name: one for name, one in zip(table.names, checked, strict=True) if one is not None}
    problems.extend(twins_among(usable).values())
    problems.extend(_noise(cohort, [one.levels for one in usable.values() if one.levels is not None]))
    layout = said.file.layout
    beside = [path.name for path in _files(cohort) if path.stem not in table.names]
    own = _nobodys(cohort, layout, table.names) if layout.table.file else _unused(cohort / RECORDINGS, beside)
    notes = (*own, *(f"{cohort / SUBJECTS}: {each}" for each in table.left_out))
    return CohortReport(tuple(usable.values()), said.file.origin, tuple(problems), notes, table.visits)


def _collect(problems: list[Problem], read: Callable[[], Value]) -> Value | None:
    """Return what ``read`` returns, or None after noting its problems."""
    try:
        return read()
    except RecordingError as error:
        problems.extend(error.problems)
        return None


def _subjects(cohort: Path) -> SubjectTable:
    check_file(cohort / SUBJECTS, cohort)
    return examine_subjects(cohort / SUBJECTS)


def _check(
    cohort: Path,
    said: Description,
    described: Callable[[str], Description],
    name: str,
    table: SubjectTable,
    grid_points: int,
) -> UsableRecording | None:
    """Read and ingest one recording; a subject whose row is wrong has its recording read all the same.

    What is wrong with the cohort's own file is said once, and not here.
    """
    said = described(name) if own_file(cohort, name).exists() else said
    raw = read_raw(cohort, name, said)
    if name not in table.rows:
        return None
    context, clinical = table.rows[name].to_context(), table.clinical[name].to_measures()
    return ingested(raw, said, context, clinical, grid_points)


def _noise(cohort: Path, levels: Sequence[RepeatLevels]) -> list[Problem]:
    """Return why the recordings together do not tell their noise, by which the study weighs them."""
    if len({type(one) for one in levels}) != 1:  # none, or of several protocols, which no study pools
        return []
    try:
        together(levels).check()
    except ValueError as error:
        remedy = "give every sample of every repeat as it was measured"
        return [Problem(str(cohort / RECORDINGS), f"{error}", remedy)]
    return []


def _recorded(cohort: Path) -> tuple[str, ...]:
    """Return the subjects that have a recording, whatever ``subjects.csv`` says."""
    files = (path for path in _files(cohort) if path.suffix.lower() in SUFFIXES and is_subject(path.stem))
    return tuple(dict.fromkeys(path.stem for path in files))


def _unused(place: Path, what: Sequence[str]) -> list[str]:
    return [f"{place}: not used, since subjects.csv does not name them: {', '.join(what)}"] if what else []


def _nobodys(cohort: Path, layout: TableLayout, names: tuple[str, ...]) -> list[str]:
    """Say whose rows of a shared table are of no subject; nothing of a table that cannot be read."""
    path = cohort / str(layout.table.file)
    try:
        rows = Counter(open_table(path, layout).cells.get(layout.columns[SUBJECT], []))
    except RecordingError:
        return []
    return _unused(path, [f"{name} ({count} rows)" for name, count in rows.items() if name not in names])


def _files(cohort: Path) -> list[Path]:
    """Return what lies beside the recordings' places; names from ``_`` or ``.`` on are not meant as such."""
    folder = cohort / RECORDINGS
    files = folder.iterdir() if folder.is_dir() else ()
    return sorted(path for path in files if not path.name.startswith(("_", ".")))


def summary(report: CohortReport) -> str:
    """Return a table with one line a subject, what its columns mean, who has further measures or visits."""
    observed = [subject.observation for subject in report.subjects]
    tables = []
    for is_gated, header, legend in ((True, HEADER, LEGEND), (False, FREE_HEADER, FREE_LEGEND)):
        if rows := [_row(one) for one in observed if one.is_gated is is_gated]:
            tables.append("\n".join([*aligned([header, *rows]), "", legend]))
    left_out = [f"{one.observation.subject}: {said}." for one in report.subjects for said in one.left_out]
    further = [*_measured(observed), *persons_in_words(report.visits), *left_out]
    return "\n".join(["\n\n".join(tables), *further])


def _measured(observed: Sequence[Observation]) -> list[str]:
    """Say of which subjects there are measures beside the speeds; nothing if of none."""
    having = {
        "cuff pressures": [one.subject for one in observed if one.clinical.has_pressures],
        "ejection time": [one.subject for one in observed if one.clinical.has_ejection_time],
    }
    return [f"{name}: {', '.join(subjects)}." for name, subjects in having.items() if subjects]


def _row(observed: Observation) -> tuple[str, ...]:
    relative, stiffness = observed.relative_se, observed.stiffness_kpa[observed.measured]
    median, kpa = f"{float(np.median(relative)):.1%}", f"{stiffness.min():.1f}-{stiffness.max():.1f}"
    reasons = ", ".join(f"{reason} {count}" for reason, count in observed.rejected.items() if count) or "none"
    if not observed.is_gated:
        return (
            observed.subject,
            str(int(observed.measured.sum())),
            str(sum(observed.rejected.values())),
            str(observed.beats),
            median,
            kpa,
            f"{SOURCES[observed.errors_from]}; rejected: {reasons}",
        )
    return (
        observed.subject,
        f"{int(observed.measured.sum())}/{len(observed.phase)}",
        str(int(observed.samples_accepted.sum())),
        str(int(observed.samples_rejected.sum())),
        median,
        f"{float(relative.max()):.1%}",
        f"{observed.noise.repeat_fraction:.1%}",
        f"{observed.noise.sample_fraction:.1%}",
        kpa,
        reasons,
    )


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Pad the cells: the first and the last column to the left, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *middle, last in rows:
        numbers = [cell.rjust(width) for cell, width in zip(middle, widths[1:-1], strict=True)]
        lines.append("  ".join([first.ljust(widths[0]), *numbers, last]))
    return lines
