"""A proposal of how a table of another tool is to be read, from the names of its columns and their units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from swesbi.base.terminal import printable
from swesbi.recording.cohort import EXCEL
from swesbi.recording.columns import (
    COLUMNS,
    FREE_REQUIRED,
    MEASURED,
    MODULUS,
    SHEAR_MODULUS,
    SPEED,
    STANDARD_ERROR,
    TIME,
)
from swesbi.recording.content import csv_rows, in_one_line
from swesbi.recording.layout import SUBJECT
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.units import MODULUS_UNITS, SPEED_UNITS, UNITS, stated_unit
from swesbi.recording.workbook import sheet_rows

WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    SUBJECT: ("subject", "patient", "id", "case", "volunteer", "participant"),
    "trigger_delay_ms": ("trigger", "delay", "time", "t"),
    "rr_ms": ("rr", "beat", "cycle"),
    "phase_index": ("phase", "gate"),
    "repeat": ("repeat", "acq", "acquisition", "repetition", "sweep", "run"),
    SPEED: ("sws", "swv", "speed", "velocity", "c", "cs"),
    MODULUS: ("young", "youngs"),
    SHEAR_MODULUS: ("mu", "shear modulus"),
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
    SPEED: WORDS[SPEED],
    MODULUS: WORDS[MODULUS],
    SHEAR_MODULUS: WORDS[SHEAR_MODULUS],
    "fit_r2": WORDS["fit_r2"],
    "status": WORDS["status"],
}
"""The same of a free-running recording."""
STIFFNESS: Final = ("modulus", "stiffness", "elasticity", "e")
"""Words of a speed, of Young's or of the shear modulus: a unit tells the first, and nothing the others."""
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
    "Means with standard errors are not taken: errors are estimated from repeats, so give the samples."
)


@dataclass(frozen=True)
class Proposal:
    """How a table can be read.

    Attributes:
        columns: This project's column: the file's, or a pattern.
        units: Units that names of columns state, where they are not this project's.
        missing: Columns that the file does not seem to have.
        unused: Columns that are of no use.
        spreads: Columns that seem to be standard errors or deviations, and are not used.
        free: Whether it seems to be free-running: it has times, and no phases or delays.
        either: Columns of Young's or of the shear modulus; nothing tells which.
        header_row: Row of the names, where rows stand before it.
        first_phase: Number of the first phase.
    """

    columns: Mapping[str, str | tuple[str, ...]]
    units: Mapping[str, str]
    missing: tuple[str, ...]
    unused: tuple[str, ...]
    spreads: tuple[str, ...]
    free: bool = False
    either: tuple[str, ...] = ()
    header_row: int | None = None
    first_phase: int = 0


def proposal_for(path: Path) -> Proposal:
    """Return how a table can be read: its names are the first row with more than one filled cell.

    Raises:
        RecordingError: The file cannot be read, or has no such row.
    """
    rows = sheet_rows(path, None) if path.suffix.lower() in EXCEL else list(csv_rows(path)[0])
    filled = [
        (row, [in_one_line(cell) for cell in cells]) for row, cells in rows if any(map(str.strip, cells))
    ]
    for place, (row, cells) in enumerate(filled):
        if len(names := [cell for cell in cells if cell]) > 1:
            proposal = propose(names)
            return replace(
                proposal,
                header_row=row if place else None,
                first_phase=_first_phase(cells, filled[place + 1 :], proposal.columns.get("phase_index")),
            )
    raise RecordingError(Problem(str(path), "has no row with names of columns", "give a table"))


def _first_phase(
    names: Sequence[str], below: Sequence[tuple[int, Sequence[str]]], column: str | tuple[str, ...] | None
) -> int:
    """Return 1 where phases are numbered from 1, or else 0."""
    if not isinstance(column, str):
        return 0
    numbers = {cells[names.index(column)].strip() for _, cells in below if len(cells) == len(names)}
    return 1 if numbers & {"1", "1.0"} and not numbers & {"0", "0.0"} else 0


def propose(names: Sequence[str]) -> Proposal:
    """Return how a table with these columns can be read; a guess, to be looked at."""
    free = _is_free(names)
    spreads = [name for name in names if set(_words(name)) & set(SPREADS)]
    left = [name for name in names if name not in spreads]
    columns: dict[str, str | tuple[str, ...]] = {}
    if free and (error := next((name for name in spreads if set(_words(name)) & set(ERRORS)), None)):
        columns[STANDARD_ERROR] = error
        spreads.remove(error)
    wide = _wide(left, names)
    if wide and (measured := _measured(wide[0])):
        columns[measured] = wide[1]
        left = [name for name in left if name not in wide[0]]
    for column, words in (OF_FREE if free else WORDS).items():
        if column in columns or (column in MEASURED and any(name in columns for name in MEASURED)):
            continue
        found = next((name for word in words for name in left if _may_be(name, word, column)), None)
        if found is None and column == SPEED:
            found = next((name for name in left if _is_speed(name)), None)
        if found is not None:
            columns[column] = found
            left.remove(found)
    known = any(name in columns for name in MEASURED)
    either = () if known else tuple(name for name in left if set(_words(name)) & set(STIFFNESS))
    left = [name for name in left if name not in either]
    units = {
        column: unit
        for column, found in columns.items()
        if (unit := _unit(column, wide[0][0] if wide and found == wide[1] else str(found)))
    }
    needed = FREE_REQUIRED if free else NEEDED
    not_needed = {"sample"} if wide else set()
    missing = [name for name in needed if name not in columns and name not in not_needed]
    if not known and not either:
        missing.append(SPEED)
    return Proposal(columns, units, tuple(missing), tuple(left), tuple(spreads), free, either)


def _is_free(names: Sequence[str]) -> bool:
    """Tell whether columns seem to be those of a free-running recording."""
    words = {word for name in names for word in _words(name)}
    return not words & set(GATED_WORDS) and bool(words & {*OF_FREE[TIME]})


def _wide(left: Sequence[str], names: Sequence[str]) -> tuple[tuple[str, ...], str | tuple[str, ...]] | None:
    """Return the longest run of names that differ by a number alone, and how to name it.

    That is a pattern where it matches no other of all names.
    """
    stems: dict[str, list[str]] = {}
    for name in left:
        if match := NUMBERED.fullmatch(name):
            stems.setdefault(match[1], []).append(name)
    stem, members = max(stems.items(), key=lambda item: len(item[1]), default=("", []))
    if len(members) < LEAST_WIDE or not stem:
        return None
    alone = sum(name.startswith(stem) for name in names) == len(members) and "*" not in stem
    return tuple(members), f"{stem}*" if alone else tuple(members)


def _measured(members: Sequence[str]) -> str | None:
    """Return which of what may be measured stands side by side; None of what nothing tells."""
    name = members[0]
    if _is_speed(name):
        return SPEED
    told = (column for column in MEASURED for word in WORDS[column] if _may_be(name, word, column))
    return next(told, None if set(_words(name)) & set(STIFFNESS) else SPEED)


def _is_speed(name: str) -> bool:
    """Tell whether a name of stiffness states a unit of speeds."""
    return bool(set(_words(name)) & set(STIFFNESS)) and stated_unit(name) in SPEED_UNITS


def _may_be(name: str, word: str, column: str) -> bool:
    """Tell whether a name has a word of a column, and states no unit that the column is not read in."""
    stated, words = stated_unit(name), _words(name)
    return (word in words or (" " in word and word in " ".join(words))) and (
        name == column or stated is None or stated in UNITS.get(column, {stated: ""})
    )


def _words(name: str) -> list[str]:
    bare = re.sub(r"[(\[].*?[)\]]", " ", name.lower())
    return [word for word in re.split(r"[^a-z0-9]+", bare) if word]


def _unit(column: str, name: str) -> str:
    """Return the unit that a name states, if the column knows it and is not in it anyway."""
    stated = None if name == column else stated_unit(name)
    factor = UNITS.get(column, {}).get(stated or "", "1")
    return stated or "" if factor != "1" or stated in MODULUS_UNITS and column == STANDARD_ERROR else ""


def as_yaml(path: Path, proposal: Proposal) -> str:
    """Return the proposal as part of ``recording.yaml``, with what is left to be decided as comments."""
    lines = [f"# Proposed for {path.name} from the names of its columns; look at every line.", "columns:"]
    lines += [f"  {column}: {_listed(name)}" for column, name in proposal.columns.items()]
    if proposal.units:
        lines += ["units:", *(f"  {column}: {_quoted(unit)}" for column, unit in proposal.units.items())]
    lines.append("table:")
    if SUBJECT in proposal.columns:
        lines.append(f"  file: {_quoted(path.name)} # one table of all subjects, in the cohort's folder")
    if proposal.header_row is not None:
        lines.append(f"  header_row: {proposal.header_row}")
    if not proposal.free:
        lines.append(f"  first_phase: {proposal.first_phase} # the number of the first phase, 0 or 1")
    lines.append("  statuses: {} # the table's word: one of ok, no_wave, motion, low_r2, bound_hit")
    lines.append("  values: {} # of columns that it lacks, where one value holds for all: { fit_r2: 1 }")
    for name in proposal.either:
        ask = f"name it under `columns` as {MODULUS} or as {SHEAR_MODULUS}"
        lines.append(f"# {name} is Young's modulus E = 3 rho c^2 or the shear modulus rho c^2: {ask}.")
    for column in proposal.missing:
        say = (
            f"under `values` say `{column}: {CONSTANTS[column]}` if that is so"
            if column in CONSTANTS
            else ADD
        )
        lines.append(f"# No column seems to be {column}: {say}.")
    if proposal.free:
        lines += [AS_FREE] if STANDARD_ERROR in proposal.columns else [AS_FREE, NO_ERRORS]
    if proposal.spreads:
        why = NO_DEVIATIONS if proposal.free else NO_MEANS
        lines.append(f"# Not used: {', '.join(proposal.spreads)}. {why}")
    lines += [f"# Not used: {', '.join(proposal.unused)}"] if proposal.unused else []
    return printable("\n".join(lines)) + "\n"


def _listed(names: str | tuple[str, ...]) -> str:
    return _quoted(names) if isinstance(names, str) else f"[{', '.join(map(_quoted, names))}]"


def _quoted(text: str) -> str:
    """Return a text in quotes; signs that cannot be printed, which YAML refuses, stand as their escapes."""
    if text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return '"' + printable(text.replace("\\", r"\\").replace('"', r"\"")) + '"'
