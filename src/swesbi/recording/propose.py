"""A proposal of how a table of another tool is to be read, from the names of its columns alone."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.recording.cohort import EXCEL
from swesbi.recording.columns import (
    COLUMNS,
    FREE_REQUIRED,
    MODULUS,
    SPEED,
    STANDARD_ERROR,
    TIME,
)
from swesbi.recording.layout import MEASURED, SHEAR_MODULUS, SUBJECT, UNITS
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.table import csv_rows
from swesbi.recording.workbook import sheet_rows

WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    SUBJECT: ("subject", "patient", "id", "case", "volunteer", "participant"),
    "trigger_delay_ms": ("trigger", "delay", "time", "t"),
    "rr_ms": ("rr", "beat", "cycle"),
    "phase_index": ("phase", "gate"),
    "repeat": ("repeat", "acq", "acquisition", "repetition", "sweep", "run"),
    SHEAR_MODULUS: ("mu", "shear modulus"),
    MODULUS: ("young", "youngs", "modulus", "stiffness", "elasticity", "e"),
    SPEED: ("sws", "swv", "speed", "velocity", "c", "cs"),
    "sample": ("sample", "roi", "point", "position"),
    "fit_r2": ("r2", "quality", "fit", "confidence"),
    "status": ("status", "flag", "valid", "result"),
}
"""Words in the names of columns, the columns in the order in which they choose."""
OF_FREE: Final[Mapping[str, tuple[str, ...]]] = {
    SUBJECT: WORDS[SUBJECT],
    "rr_ms": ("rr", "cycle", "interval"),
    TIME: ("time", "instant", "t"),
    "beat": ("beat", "heartbeat"),
    "repeat": (*WORDS["repeat"], "train"),
    SHEAR_MODULUS: WORDS[SHEAR_MODULUS],
    MODULUS: WORDS[MODULUS],
    SPEED: WORDS[SPEED],
    "fit_r2": WORDS["fit_r2"],
    "status": WORDS["status"],
}
"""The same of a free-running recording."""
GATED_WORDS: Final = ("phase", "gate", "trigger", "delay")
ERRORS: Final = ("se", "sem", "stderr")
"""Words of standard errors, which a free-running recording may have; a standard deviation is none."""
SPREADS: Final = ("se", "sem", "sd", "std", "stderr", "stdev")
NUMBERED: Final = re.compile(r"(.*?)\d+\s*(?:[(\[][^()\[\]]*[)\]])?", re.DOTALL)
LEAST_WIDE: Final = 3
NEEDED: Final = tuple(name for name in COLUMNS if name != SPEED)
CONSTANTS: Final = {"status": "ok", "fit_r2": "1", "sample": "counted", "phase_index": "counted"}
ADD: Final = "name it under `columns`, or add it to the table"
AS_FREE: Final = (
    f"# Read as free-running: it has times and no phases. Of gated pushes, call `{TIME}` trigger_delay_ms."
)
NO_ERRORS: Final = (
    f"# No column seems to be {STANDARD_ERROR}: without repeats, nothing tells the errors of the speeds. Say "
    "`noise: { fit_points: 12 }`\n# where fit_r2 is that of a line through so many points, or declare "
    "`noise: { cv_fraction: 0.1, cv_log_sd: 0.3 }`."
)
NO_DEVIATIONS: Final = (
    "A standard deviation is no standard error: divide it by the root of the number of samples, and call it "
    f"{STANDARD_ERROR}."
)
NO_MEANS: Final = (
    "Means with standard errors are not taken: errors are told from repeats, so give the samples."
)


@dataclass(frozen=True)
class Proposal:
    """How a table may be read.

    Attributes:
        columns: This project's column: the file's, or a pattern.
        units: Units that names of columns state, where they are not this project's.
        missing: Columns that the file does not seem to have.
        unused: Columns that are of no use.
        spreads: Columns that seem to be standard errors or deviations, and are not used.
        free: Whether it seems to be free-running: it has times, and no phases or delays.
    """

    columns: Mapping[str, str]
    units: Mapping[str, str]
    missing: tuple[str, ...]
    unused: tuple[str, ...]
    spreads: tuple[str, ...]
    free: bool = False


def names_of(path: Path) -> list[str]:
    """Return the names of a table's columns: its first row with more than one filled cell.

    Raises:
        RecordingError: The file cannot be read, or has no such row.
    """
    rows = sheet_rows(path, None) if path.suffix.lower() in EXCEL else csv_rows(path)[0]
    for _, cells in rows:
        if len(names := [cell.strip() for cell in cells if cell.strip()]) > 1:
            return names
    raise RecordingError(Problem(str(path), "has no row with names of columns", "give a table"))


def propose(names: Sequence[str]) -> Proposal:
    """Return how a table with these columns may be read; a guess, to be looked at."""
    free = _is_free(names)
    spreads = [name for name in names if set(_words(name)) & set(SPREADS)]
    left = [name for name in names if name not in spreads]
    columns: dict[str, str] = {}
    if free and (error := next((name for name in spreads if set(_words(name)) & set(ERRORS)), None)):
        columns[STANDARD_ERROR] = error
        spreads.remove(error)
    if wide := _wide(left):
        pattern, members = wide
        measured = _measured(pattern)
        columns[measured] = pattern
        left = [name for name in left if name not in members]
    for column, words in (OF_FREE if free else WORDS).items():
        if column in columns or (column in MEASURED and any(name in columns for name in MEASURED)):
            continue
        found = next((name for word in words for name in left if _has(name, word)), None)
        if found is not None:
            columns[column] = found
            left.remove(found)
    stated = {column: wide[1][0] if wide and name == wide[0] else name for column, name in columns.items()}
    units = {column: unit for column, name in stated.items() if (unit := _unit(column, name))}
    needed = FREE_REQUIRED if free else NEEDED
    not_needed = {"sample"} if wide else set()
    missing = [name for name in needed if name not in columns and name not in not_needed]
    if not any(name in columns for name in MEASURED):
        missing.append(SPEED)
    return Proposal(columns, units, tuple(missing), tuple(left), tuple(spreads), free)


def _is_free(names: Sequence[str]) -> bool:
    """Tell whether columns seem to be those of a free-running recording."""
    words = {word for name in names for word in _words(name)}
    return not words & set(GATED_WORDS) and bool(words & {*OF_FREE[TIME]})


def _wide(names: Sequence[str]) -> tuple[str, list[str]] | None:
    """Return the pattern and the columns of the longest run of names that differ by a number alone."""
    stems: dict[str, list[str]] = {}
    for name in names:
        if match := NUMBERED.fullmatch(name):
            stems.setdefault(match[1], []).append(name)
    stem, members = max(stems.items(), key=lambda item: len(item[1]), default=("", []))
    return (f"{stem}*", members) if len(members) >= LEAST_WIDE and stem else None


def _measured(pattern: str) -> str:
    return next((name for name in MEASURED[:0:-1] if any(_has(pattern, word) for word in WORDS[name])), SPEED)


def _words(name: str) -> list[str]:
    bare = re.sub(r"[(\[].*?[)\]]", " ", name.lower())
    return [word for word in re.split(r"[^a-z0-9]+", bare) if word]


def _has(name: str, word: str) -> bool:
    words = _words(name)
    return word in words or (" " in word and word in " ".join(words))


def _unit(column: str, name: str) -> str:
    """Return the unit that a name states, if the column knows it and is not in it anyway."""
    own = next((unit for unit, factor in UNITS.get(column, {}).items() if factor == "1"), "")
    stated = {part.lower() for part in re.findall(r"[(\[]\s*(.*?)\s*[)\]]", name)}
    stated |= {name.lower().rsplit("_", 1)[-1]} if "_" in name else set()
    return next((unit for unit in UNITS.get(column, {}) if unit.lower() in stated and unit != own), "")


def as_yaml(path: Path, proposal: Proposal) -> str:
    """Return the proposal as part of ``recording.yaml``, with what is left to be decided as comments."""
    lines = [f"# Proposed for {path.name} from the names of its columns; look at every line.", "columns:"]
    lines += [f"  {column}: {_quoted(name)}" for column, name in proposal.columns.items()]
    if proposal.units:
        lines += ["units:", *(f"  {column}: {_quoted(unit)}" for column, unit in proposal.units.items())]
    lines.append("table:")
    if SUBJECT in proposal.columns:
        lines.append(f"  file: {_quoted(path.name)} # one table of all subjects, in the cohort's folder")
    if not proposal.free:
        lines.append("  first_phase: 0 # 1 if the first phase has the number 1")
    lines.append("  statuses: {} # the table's word: one of ok, no_wave, motion, low_r2, bound_hit")
    lines.append("  values: {} # of columns that it lacks, where one value holds for all: { fit_r2: 1 }")
    for column in proposal.missing:
        say = (
            f"under `values` say `{column}: {CONSTANTS[column]}` if that is so"
            if column in CONSTANTS
            else ADD
        )
        lines.append(f"# No column seems to be {column}: {say}.")
    lines += _of_kind(proposal)
    if proposal.spreads:
        why = NO_DEVIATIONS if proposal.free else NO_MEANS
        lines.append(f"# Not used: {', '.join(proposal.spreads)}. {why}")
    lines += [f"# Not used: {', '.join(proposal.unused)}"] if proposal.unused else []
    return "\n".join(lines) + "\n"


def _of_kind(proposal: Proposal) -> list[str]:
    """Return what is to be known of a free-running recording."""
    if not proposal.free:
        return []
    return [AS_FREE] if STANDARD_ERROR in proposal.columns else [AS_FREE, NO_ERRORS]


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
