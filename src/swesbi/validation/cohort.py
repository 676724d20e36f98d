"""Examining a whole cohort: every problem of every file, or else what each recording comes to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from swesbi.recording.files import RECORDINGS, SUBJECTS, SUFFIXES, check_file, find_recording
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.quality import rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples
from swesbi.recording.settings import ContextRow, RecordingSettings, is_subject
from swesbi.recording.subjects import SubjectTable, examine_subjects
from swesbi.validation.protocol import Protocol, read_protocol

Value = TypeVar("Value")


@dataclass(frozen=True)
class Checked:
    """One subject whose recording can be used.

    Attributes:
        samples: The raw recording, N samples.
        verdict: Index of the reason for which each sample is rejected, -1 where accepted; shape (N,).
        observation: The observed curve.
    """

    samples: Samples
    verdict: NDArray[np.int64]
    observation: Observation


@dataclass(frozen=True)
class CohortReport:
    """What a cohort holds.

    Attributes:
        subjects: The subjects without a problem, in the order of ``subjects.csv``.
        origin: Where the recordings come from; empty if the cohort does not say.
        problems: Everything that must be corrected.
        notes: What is odd, and harmless.
    """

    subjects: tuple[Checked, ...]
    origin: str
    problems: tuple[Problem, ...]
    notes: tuple[str, ...]


def examine_cohort(cohort: Path, settings: RecordingSettings, grid_points: int) -> CohortReport:
    """Check every file of a cohort, and ingest every recording, without writing anything.

    Args:
        cohort: Folder with ``subjects.csv``, ``recording.yaml`` and ``swe/``.
        settings: Quality control and completeness.
        grid_points: Number of points of the analysis grid.
    """
    if not cohort.is_dir():
        absent = Problem(str(cohort), "is no folder", "correct the path; `template` starts a new cohort")
        return CohortReport((), "", (absent,), ())
    problems: list[Problem] = []
    table = _collect(problems, partial(_subjects, cohort)) or SubjectTable(_recorded(cohort), {}, ())
    problems.extend(table.problems)
    protocol = _collect(problems, partial(read_protocol, cohort, settings)) or Protocol("")
    check = partial(_check, cohort, rows=table.rows, settings=settings, grid_points=grid_points)
    checked = [_collect(problems, partial(check, name)) for name in table.names]
    subjects = tuple(subject for subject in checked if subject)
    return CohortReport(subjects, protocol.origin, tuple(problems), _notes(cohort, table.names))


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
    cohort: Path, name: str, rows: Mapping[str, ContextRow], settings: RecordingSettings, grid_points: int
) -> Checked | None:
    """Read and ingest one recording; a subject whose row is wrong has its recording read all the same."""
    path = find_recording(cohort, name)
    samples = read_samples(path, settings.phases, settings.density_kg_m3)
    if name not in rows:
        return None
    observation = ingest(samples, rows[name].to_context(), settings, grid_points)
    return Checked(samples, rejection(samples, settings), observation)


def _recorded(cohort: Path) -> tuple[str, ...]:
    """Return the subjects that have a recording, whatever ``subjects.csv`` says."""
    files = (path for path in _files(cohort) if path.suffix in SUFFIXES and is_subject(path.stem))
    return tuple(dict.fromkeys(path.stem for path in files))


def _notes(cohort: Path, names: tuple[str, ...]) -> tuple[str, ...]:
    unused = [path.name for path in _files(cohort) if path.stem not in names]
    if not unused:
        return ()
    return (f"{cohort / RECORDINGS}: not used, since subjects.csv does not name them: {', '.join(unused)}",)


def _files(cohort: Path) -> list[Path]:
    """Return what lies beside the recordings' places; names from ``_`` or ``.`` on are not meant as such."""
    folder = cohort / RECORDINGS
    found = folder.iterdir() if folder.is_dir() else ()
    return sorted(path for path in found if not path.name.startswith(("_", ".")))
