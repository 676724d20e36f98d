"""Units of the columns of a recording: which each may be in, and which the name of a column states."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from swesbi.recording.columns import MODULUS, SHEAR_MODULUS, SPEED, STANDARD_ERROR, TIME
from swesbi.recording.problems import Problem, RecordingError

SPEED_UNITS: Final = {"m/s": "1", "cm/s": "0.01", "mm/s": "0.001"}
MODULUS_UNITS: Final = {"kPa": "1", "Pa": "0.001"}
TIME_UNITS: Final = {"ms": "1", "s": "1000"}
FRACTION_UNITS: Final = {"1": "1", "%": "0.01"}
UNITS: Final[Mapping[str, Mapping[str, str]]] = {
    SPEED: SPEED_UNITS,
    MODULUS: MODULUS_UNITS,
    SHEAR_MODULUS: MODULUS_UNITS,
    "trigger_delay_ms": TIME_UNITS,
    "rr_ms": TIME_UNITS,
    TIME: TIME_UNITS,
    STANDARD_ERROR: {**SPEED_UNITS, **MODULUS_UNITS, "%": "0.01"},
    "fit_r2": FRACTION_UNITS,
}
"""What a number in each unit is multiplied by for the column's own, as text that is exact in decimals; a
standard error in a unit of moduli becomes one in kPa, and one in % a share of the speed."""
SPELLINGS: Final[Mapping[str, str]] = {
    "m/s": "m/s", "m/sec": "m/s", "ms-1": "m/s", "m_s": "m/s",
    "cm/s": "cm/s", "cm/sec": "cm/s", "cms-1": "cm/s", "cm_s": "cm/s",
    "mm/s": "mm/s", "mm/sec": "mm/s", "mms-1": "mm/s", "mm_s": "mm/s",
    "kpa": "kPa", "pa": "Pa",
    "ms": "ms", "msec": "ms", "millisecond": "ms", "milliseconds": "ms",
    "s": "s", "sec": "s", "second": "s", "seconds": "s",
    "%": "%", "percent": "%", "pct": "%",
    "fraction": "1",
}  # fmt: skip
"""How units are spelled, in lower case and without blanks, dots and carets."""
ENDINGS: Final = ("m_s", "cm_s", "mm_s", "kpa", "pa", "ms", "msec", "sec", "pct", "percent")
"""Spellings that count at the end of a name without brackets; a single letter there is a symbol as well."""


def stated_unit(name: str) -> str | None:
    """Return the unit that the name of a column states, in brackets or at its end; None where it states none.

    What begins with a per cent sign, "% RR" say, is in per cent.
    """
    inside = [re.sub(r"[\s.·*^]", "", part).lower() for part in re.findall(r"[(\[{](.*?)[)\]}]", name)]
    for part in inside:
        if part in SPELLINGS:
            return SPELLINGS[part]
        if part.startswith(("%", "percent")):
            return "%"
    words = re.split(r"[\s_,]+", re.sub(r"[(\[{].*?[)\]}]", " ", name).strip().lower())
    endings = ("_".join(words[-2:]), words[-1]) if len(words) > 1 else ()
    return next(
        (SPELLINGS[one] for one in endings if one in ENDINGS or "/" in one and one in SPELLINGS), None
    )


def unit_of(path: Path, column: str, names: Sequence[str], said: str | None) -> str | None:
    """Return the unit that a column of a table is in, where it is not this project's own; None where it is.

    Args:
        path: The table, for messages.
        column: This project's column.
        names: What the table calls it; several where samples stand side by side.
        said: What ``recording.yaml`` says of its unit, which alone counts where the name is this project's.

    Raises:
        RecordingError: Names state a unit that contradicts this, or that no such column is in.
    """
    for name in names:
        stated = None if name == column else stated_unit(name)
        if stated is None:
            continue
        if stated not in UNITS[column]:
            reason = f"states {stated}, and {column} is read in {', '.join(UNITS[column])}"
            remedy = "map it to another column in recording.yaml, or convert and rename it"
            raise RecordingError(Problem(str(path), reason, remedy, column=name))
        if said is not None and said != stated:
            reason = f"states {stated}, and `units.{column}` of recording.yaml is {said}"
            raise RecordingError(Problem(str(path), reason, "correct one of them", column=name))
        said = stated
    return said
