"""The files of a cohort: which is a subject's recording, and what else lies there in its place."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.recording.problems import RecordingError, refusal
from swesbi.recording.settings import is_subject
from swesbi.recording.tables.files import OTHERS, SUFFIXES
from swesbi.recording.tables.table import spelling

SUBJECTS: Final = "subjects.csv"
RECORDING_FILE: Final = "recording.yaml"
RECORDINGS: Final = "swe"


def find_recording(cohort: Path, subject: str, shared: str | None = None) -> Path:
    """Return the one file that holds a subject's raw samples; ``shared`` names a table of all subjects."""
    if not is_subject(subject):
        raise refusal(
            cohort / SUBJECTS,
            "is no name for a subject",
            "use letters, digits, '-' and '_', a letter or digit first",
            value=subject,
        )
    if shared is not None:
        check_file(cohort / shared, cohort)
        return cohort / shared
    folder = cohort / RECORDINGS
    files = [path for path in _listed(folder) if path.stem == subject and path.suffix.lower() in SUFFIXES]
    if len(files) > 1:
        raise refusal(
            files[0], f"there is {files[1].name} beside {files[0].name}", "keep the one that counts"
        )
    if not files:
        raise _absent(folder, subject)
    check_file(files[0], cohort)
    return files[0]


def check_file(path: Path, cohort: Path) -> None:
    """Refuse what is no regular file, or a link that leads out of the cohort."""
    if not path.exists():
        beside = [] if path.is_symlink() else _listed(path.parent)
        if other := next((each for each in beside if _alike(each, path)), None):
            verb = "save it as" if path.suffix == ".csv" and other.suffix.lower() != ".csv" else "call it"
            raise refusal(path, f"no such file, but there is {other.name}", f"{verb} {path.name}")
        above = cohort.parent / path.name if cohort.name == RECORDINGS else path
        remedy = f"name the folder above, {cohort.parent}" if above.exists() else "put the file there"
        raise refusal(path, "no such file", remedy)
    if not path.resolve().is_relative_to(cohort.resolve()):
        raise refusal(
            path,
            "is reached by a link that leads out of the cohort",
            "copy the file into the cohort, which must be whole in itself",
        )
    if not path.is_file():
        raise refusal(path, "is no regular file", "put the file itself there")


def _alike(other: Path, wanted: Path) -> bool:
    """Tell whether a file is called as another is, but for case, signs, zeros or suffix."""
    return other.is_file() and spelling(other.stem) == spelling(wanted.stem) and other.name != wanted.name


def _listed(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []


def _absent(folder: Path, subject: str) -> RecordingError:
    """Return what to say of a recording that is not there, and of what lies in its place."""
    reason = f"there is no file {', '.join(f'{subject}{suffix}' for suffix in SUFFIXES)}"
    beside = [each for each in _listed(folder.parent) if each.is_dir() and each.name.lower() == RECORDINGS]
    if beside and not folder.is_dir():
        return refusal(folder, f"is no folder, but there is {beside[0].name}", f"call it {RECORDINGS}")
    files = [path for path in _listed(folder) if path.suffix.lower() not in (".yaml", ".yml")]
    if other := [path for path in files if path.name.split(".")[0] == subject]:
        what, remedy = OTHERS.get(other[0].suffix.lower(), ("is of no format that is read", "save it as CSV"))
        return refusal(other[0], what, remedy)
    if alike := [path for path in files if spelling(path.stem) == spelling(subject)]:
        remedy = f"call the subject {alike[0].stem}, or the file {subject}{alike[0].suffix}"
        return refusal(folder, f"{reason}, but there is {alike[0].name}", remedy)
    return refusal(folder, reason, "put it there, or take the subject out of subjects.csv")
