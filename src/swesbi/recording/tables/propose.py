"""What a table of another tool holds, column by column, and the part of ``recording.yaml`` that reads it.

A column is filled in where it is called as this project's, or where it alone has the kind and unit of one.
Where two could be meant, none is filled in and both are listed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.base.terminal import printable
from swesbi.recording.problems import refusal
from swesbi.recording.tables.files import MATLAB, open_table, rows_as_they_stand
from swesbi.recording.tables.layout import (
    COLUMNS,
    DELAY,
    EVERY_COLUMN,
    FREE_REQUIRED,
    MEASURED,
    MODULUS,
    PHASE,
    RR,
    SHEAR_MODULUS,
    SPEED,
    STANDARD_ERROR,
    SUBJECT,
    TIME,
    UNITS,
    stated_unit,
)
from swesbi.recording.tables.table import NUMBER, Row, in_one_line

WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    SUBJECT: ("subject", "patient", "id", "case", "volunteer", "participant"),
    PHASE: ("phase", "gate"),
    DELAY: ("trigger", "delay", "time", "t"),
    TIME: ("time", "instant", "t"),
    RR: ("rr", "r r", "cycle", "interval"),
    "beat": ("beat", "heartbeat", "cycle"),
    "repeat": ("repeat", "acq", "acquisition", "repetition", "sweep", "run", "train"),
    "sample": ("sample", "roi", "point", "position"),
    SPEED: ("sws", "swv", "vs", "speed", "velocity", "c", "cs"),
    MODULUS: ("young", "youngs"),
    SHEAR_MODULUS: ("mu", "shear modulus"),
    STANDARD_ERROR: ("se", "sem", "stderr"),
    "fit_r2": ("r2", "quality", "fit", "confidence"),
    "status": ("status", "flag", "valid", "result"),
}
"""Words in the names of columns, by the column that each may be."""
STIFFNESS: Final = ("modulus", "stiffness", "elasticity", "e")
"""Words of a speed, of Young's or of the shear modulus: a unit tells the first, and nothing the others."""
OF_GATES: Final = ("phase", "gate", "trigger", "delay")
SPREADS: Final = ("se", "sem", "sd", "std", "stderr", "stdev", "iqr", "mad", "var", "variance")
"""Words of spreads, which are no measured value; of these standard errors alone are read, of push trains."""
GATED_ALONE: Final = (PHASE, DELAY, "sample")
FREE_ALONE: Final = (TIME, "beat", STANDARD_ERROR)
SHOWN: Final = 3
LONGEST: Final = 24
CONSTANTS: Final = {"status": "ok", "fit_r2": "1", "sample": "counted", PHASE: "counted"}
NO_ERRORS: Final = (
    f"# No column seems to be {STANDARD_ERROR}: without repeats, nothing tells the errors of the speeds.\n"
    "# Say `noise: { fit_points: 12 }` where fit_r2 is that of a line through so many points, or declare\n"
    "# `noise: { cv_fraction: 0.1, cv_log_sd: 0.3 }`."
)
AS_FREE: Final = (
    f"# Read as free-running: it has times and no phases. Of gated pushes, map `{DELAY}` instead."
)


@dataclass(frozen=True)
class Proposal:
    """How a table can be read: by this project's column, the file's.

    ``columns`` are those where one alone can be meant, ``candidates`` those of which any could be. ``first``
    has the first values of each column of the file. ``free``: it has times, and no phases or delays.
    """

    columns: Mapping[str, str]
    candidates: Mapping[str, tuple[str, ...]]
    first: Mapping[str, tuple[str, ...]]
    header_row: int = 1
    first_phase: int = 0
    free: bool = False


def proposal_for(path: Path) -> Proposal:
    """Return how a table can be read."""
    if path.suffix.lower() == MATLAB:
        table = open_table(path)
        return propose(list(table.cells), [list(row) for row in zip(*table.cells.values(), strict=True)])
    rows = [(place, [in_one_line(cell) for cell in cells]) for place, cells in rows_as_they_stand(path)]
    header = _header(rows)
    if header is None:
        raise refusal(path, "has no row of names with rows of as many cells below it", "give a table")
    place, names = rows[header]
    below = [cells for _, cells in rows[header + 1 :] if len(cells) == len(names) and any(cells)]
    return propose(names, below, place)


def _header(rows: Sequence[Row]) -> int | None:
    """Return the first row of names, none of them a number, as wide as most of the rows below it."""
    for number, (_, cells) in enumerate(rows):
        widths = [_width(other) for _, other in rows[number + 1 :] if any(other)]
        common = max(widths, key=widths.count, default=0)
        named = [cell for cell in cells if cell]
        if (
            len(named) > 1
            and len(named) >= common > 1
            and not any(re.fullmatch(NUMBER, cell) for cell in named)
        ):
            return number
    return None


def _width(cells: Sequence[str]) -> int:
    return max((number for number, cell in enumerate(cells, start=1) if cell), default=0)


def propose(names: Sequence[str], rows: Sequence[Sequence[str]] = (), header_row: int = 1) -> Proposal:
    """Return how a table with columns of these names and rows can be read."""
    words = {word for name in names for word in _words(name)}
    free = not words & set(OF_GATES) and bool(words & set(WORDS[TIME]))
    own = {*MEASURED} & {*names}
    left_out = {*(GATED_ALONE if free else FREE_ALONE), *({*MEASURED} - own if own else ())}
    chosen = [column for column in WORDS if column not in left_out]
    possible = {column: found for column in chosen if (found := _possible(names, column))}
    measured = [column for column in MEASURED if column in possible]
    claims = [name for found in possible.values() for name in found]
    alone = {
        column: found[0]
        for column, found in possible.items()
        if len(found) == 1
        and claims.count(found[0]) == 1
        and (len(measured) == 1 or column not in measured)
        and (found[0] == column or column not in UNITS or column == "fit_r2" or stated_unit(found[0]))
    }
    candidates = {column: found for column, found in possible.items() if column not in alone}
    first = {
        name: tuple(dict.fromkeys(row[place] for row in rows if row[place]))[:SHOWN]
        for place, name in enumerate(names)
        if name
    }
    return Proposal(alone, candidates, first, header_row, _first_phase(names, rows, alone.get(PHASE)), free)


def _possible(names: Sequence[str], column: str) -> tuple[str, ...]:
    """Return the columns of a table that one of ours could be: by name, by words and unit, or by words."""
    if column in names:
        return (column,)
    found = tuple(name for name in names if name and name not in EVERY_COLUMN and _may_be(name, column))
    stated = tuple(name for name in found if stated_unit(name))
    return stated or found


def _may_be(name: str, column: str) -> bool:
    """Tell whether a name has a word of a column, and states no unit that the column is not read in.

    A name with a word of spreads is of no measured value.
    """
    words, stated = _words(name), stated_unit(name)
    if column != STANDARD_ERROR and set(words) & set(SPREADS):
        return False
    if stated is not None and stated not in UNITS.get(column, {}):
        return False
    if _has(words, column):
        return True
    told = any(_has(words, each) for each in MEASURED)
    return (
        not told
        and bool(set(words) & set(STIFFNESS))
        and column in MEASURED
        and (column != SPEED or stated is not None)
    )


def _has(words: Sequence[str], column: str) -> bool:
    return any(f" {word} " in f" {' '.join(words)} " for word in WORDS[column])


def _words(name: str) -> list[str]:
    bare = re.sub(r"[(\[].*?[)\]]", " ", name.lower())
    return [word for word in re.split(r"[^a-z0-9]+", bare) if word]


def _first_phase(names: Sequence[str], rows: Sequence[Sequence[str]], column: str | None) -> int:
    """Return 1 where phases are numbered from 1, or else 0."""
    if column is None:
        return 0
    numbers = {cells[names.index(column)].strip() for cells in rows}
    return 1 if numbers & {"1", "1.0"} and not numbers & {"0", "0.0"} else 0


def as_yaml(path: Path, proposal: Proposal) -> str:
    """Return the proposal as part of ``recording.yaml``, below a list of the table's columns as comments."""
    used = {name: f" -> {column}" for column, name in proposal.columns.items()}
    width = max(map(len, proposal.first), default=0) + 2
    has_errors = STANDARD_ERROR in {*proposal.columns, *proposal.candidates}
    of_all = f"  file: {quoted(path.name)} # one table of all subjects, in the cohort's folder"
    phases = f"  first_phase: {proposal.first_phase} # the number of the first phase, 0 or 1"
    lines = [
        f"# Columns of {path.name}, with their first values; look at every line.",
        *(f"#   {name:<{width}}{_shown(own)}{used.get(name, '')}" for name, own in proposal.first.items()),
        "columns: # this project's column: that of the table",
        *(f"  {column}: {quoted(name)}" for column, name in proposal.columns.items()),
        *_undecided(proposal),
        "table:",
        *([of_all] if SUBJECT in proposal.columns else []),
        *([f"  header_row: {proposal.header_row}"] if proposal.header_row > 1 else []),
        *([] if proposal.free else [phases]),
        "  statuses: {} # the table's word: one of ok, no_wave, motion, low_r2, bound_hit",
        "  values: {} # of columns that it lacks, where one value holds for all: { fit_r2: 1 }",
        *([AS_FREE] if proposal.free else []),
        *([NO_ERRORS] if proposal.free and not has_errors else []),
    ]
    return printable("\n".join(lines)) + "\n"


def _shown(values: Sequence[str]) -> str:
    return ", ".join(one if len(one) <= LONGEST else f"{one[:LONGEST]}..." for one in values) or "empty"


def _undecided(proposal: Proposal) -> list[str]:
    """Say of which columns several could be meant, and which the table does not seem to have."""
    unit = " under `columns`, and its unit under `units`"
    lines = [
        f"  # {column}: could be {', '.join(names)}; name one{unit if column in UNITS else ''}"
        for column, names in proposal.candidates.items()
        if column not in MEASURED
    ]
    if measured := [column for column in MEASURED if column in proposal.candidates]:
        meant = ", ".join(dict.fromkeys(name for column in measured for name in proposal.candidates[column]))
        lines.append(
            f"  # {' or '.join(measured)}: could be {meant}; name the one that was measured, or if each\n"
            f"  # is a sample, list them under `table`: samples: [{{ {measured[0]}: ... }}, ...]"
        )
    known = {*proposal.columns, *proposal.candidates}
    needed = FREE_REQUIRED if proposal.free else [name for name in COLUMNS if name != SPEED]
    for column in [*needed, *([] if known & set(MEASURED) else [SPEED])]:
        if column not in known:
            constant = f"under `values` say `{column}: {CONSTANTS.get(column)}` if that is so"
            say = constant if column in CONSTANTS else "add it to the table"
            lines.append(f"  # {column}: no column seems to be it; name one, or {say}")
    return lines


def quoted(text: str) -> str:
    """Return a text in quotes; signs that cannot be printed, which YAML refuses, stand as their escapes."""
    if text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return '"' + printable(text.replace("\\", r"\\").replace('"', r"\"")) + '"'
