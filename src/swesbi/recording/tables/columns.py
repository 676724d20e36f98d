"""The columns of a recording, the words of its status, and the units in which each may be given."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

STATUS_OK: Final = "ok"
FAILED_STATUSES: Final = ("no_wave", "motion", "low_r2", "bound_hit")
STATUSES: Final = (STATUS_OK, *FAILED_STATUSES)
SUBJECT: Final = "subject"
"""Of a table of several: whose a row is."""
PHASE: Final = "phase_index"
DELAY: Final = "trigger_delay_ms"
TIME: Final = "time_ms"
RR: Final = "rr_ms"
SPEED: Final = "shear_wave_speed_m_s"
MODULUS: Final = "youngs_modulus_kpa"
SHEAR_MODULUS: Final = "shear_modulus_kpa"
MEASURED: Final = (SPEED, MODULUS, SHEAR_MODULUS)
"""What a recording measures, one of these."""
STANDARD_ERROR: Final = "se_m_s"
EVENT: Final = "event"
"""What set off a wave, in tables of natural waves; such a table is refused."""
COLUMNS: Final = (PHASE, DELAY, RR, "repeat", "sample", SPEED, "fit_r2", "status")
"""Of a gated recording, which has phases."""
FREE_REQUIRED: Final = (TIME, RR)
FREE_OPTIONAL: Final = ("beat", "repeat", STANDARD_ERROR, "fit_r2", "status")
FREE_COLUMNS: Final = (*FREE_REQUIRED, SPEED, *FREE_OPTIONAL)
"""Of a free-running recording, which has instants in place of phases."""
EVERY_COLUMN: Final = tuple(dict.fromkeys((SUBJECT, *COLUMNS, *FREE_COLUMNS, *MEASURED, EVENT)))
TEXTS: Final = (SUBJECT, "status", EVENT)
"""Columns of words."""

SPEED_UNITS: Final = {"m/s": "1", "cm/s": "0.01", "mm/s": "0.001"}
MODULUS_UNITS: Final = {"kPa": "1", "Pa": "0.001"}
TIME_UNITS: Final = {"ms": "1", "s": "1000"}
UNITS: Final[Mapping[str, Mapping[str, str]]] = {
    SPEED: SPEED_UNITS,
    MODULUS: MODULUS_UNITS,
    SHEAR_MODULUS: MODULUS_UNITS,
    DELAY: TIME_UNITS,
    RR: TIME_UNITS,
    TIME: TIME_UNITS,
    STANDARD_ERROR: {**SPEED_UNITS, **MODULUS_UNITS, "%": "0.01"},
    "fit_r2": {"1": "1", "%": "0.01"},
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


def unit_in_words(text: str) -> str | None:
    """Return the unit that a text is the name of: "m/s" of "m s^-1"; None of another text."""
    return SPELLINGS.get(re.sub(r"[\s.·*^]", "", text).lower())


def stated_unit(name: str) -> str | None:
    """Return the unit that the name of a column states, in brackets or at its end; None where it states none.

    What begins with a per cent sign, "% RR" say, is in per cent.
    """
    for part in re.findall(r"[(\[{](.*?)[)\]}]", name):
        if unit := unit_in_words(part):
            return unit
        if part.strip().lower().startswith(("%", "percent")):
            return "%"
    words = re.split(r"[\s_,]+", re.sub(r"[(\[{].*?[)\]}]", " ", name).strip().lower())
    endings = ("_".join(words[-2:]), words[-1]) if len(words) > 1 else ()
    return next(
        (SPELLINGS[one] for one in endings if one in ENDINGS or "/" in one and one in SPELLINGS), None
    )
