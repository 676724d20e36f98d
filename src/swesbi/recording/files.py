"""The files of a cohort: which one is a subject's recording, and that all lie within the cohort."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from swesbi.recording.csv_table import SAVE_AS_CSV
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.settings import is_subject

SUFFIXES: Final = (".csv", ".mat")
WORKBOOKS: Final = (".xlsx", ".xls", ".xlsm", ".ods", ".numbers")
SUBJECTS: Final = "subjects.csv"
PROTOCOL: Final = "recording.yaml"
RECORDINGS: Final = "swe"


def find_recording(cohort: Path, subject: str) -> Path:
    """Return the one file that holds a subject's raw samples.

    Raises:
        RecordingError: There is none, or more than one; it is no regular file, or lies outside the cohort;
            or the subject's name cannot be a file's.
    """
    if not is_subject(subject):
        reason = "is no name for a subject"
        remedy = "use letters, digits, '-' and '_', a letter or digit first"
        raise RecordingError(Problem(str(cohort / SUBJECTS), reason, remedy, value=subject))
    stem = cohort / RECORDINGS / subject
    found = [path for path in _with_suffixes(stem, SUFFIXES) if path.exists() or path.is_symlink()]
    if len(found) > 1:
        reason = f"there is {found[1].name} beside {found[0].name}"
        raise RecordingError(Problem(str(found[0]), reason, "keep the one that counts"))
    if not found:
        raise RecordingError(_absent(stem))
    check_file(found[0], cohort)
    return found[0]


def check_file(path: Path, cohort: Path) -> None:
    """Refuse what is no regular file, or a link that leads out of the cohort.

    Raises:
        RecordingError: It is one of these, or there is none.
    """
    if not path.exists():
        raise RecordingError(Problem(str(path), "no such file", "put the file there"))
    if not path.resolve().is_relative_to(cohort.resolve()):
        remedy = "copy the file into the cohort, which must be whole in itself"
        raise RecordingError(Problem(str(path), "is reached by a link that leads out of the cohort", remedy))
    if not path.is_file():
        raise RecordingError(Problem(str(path), "is no regular file", "put the file itself there"))


def _with_suffixes(stem: Path, suffixes: Sequence[str]) -> list[Path]:
    return [stem.with_name(stem.name + suffix) for suffix in suffixes]


def _absent(stem: Path) -> Problem:
    """Return what to say of a recording that is not there; a workbook in its place gets a hint."""
    for path in _with_suffixes(stem, WORKBOOKS):
        if path.exists():
            return Problem(str(path), "is a workbook", SAVE_AS_CSV)
    wanted = " or ".join(path.name for path in _with_suffixes(stem, SUFFIXES))
    reason = f"there is no file {wanted}"
    return Problem(str(stem.parent), reason, "put it there, or take the subject out of subjects.csv")
