"""The columns of a recording with their units, and how a table differs from them by ``recording.yaml``.

``columns`` names the table's columns, ``units`` their units, ``table`` the rest: one file for all subjects,
the sheet of a workbook, where the names stand, from which number phases count, words of the status,
constants, and columns of samples that stand side by side.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Final, Self

from pydantic import AfterValidator, Field, field_validator, model_validator

from swesbi.base.settings import Settings
from swesbi.recording.tables.table import in_one_line

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


COUNTED: Final = "counted"
COUNTABLE: Final = (PHASE, "sample")
OF_SAMPLES: Final = (*MEASURED, "fit_r2", "status")
"""Columns of which a table may have one a sample."""
LACKED: Final = tuple(dict.fromkeys((*COLUMNS, *FREE_COLUMNS)))
MEANS: Final = (
    "means with standard errors of phases are not taken, since errors are estimated from repeats: give the "
    f"samples, a row or a column each; of a free-running recording, with {TIME}, the column is se_m_s"
)


def one_of(*known: str) -> AfterValidator:
    """Return a check that a text is one of these."""

    def check(text: str) -> str:
        if text not in known:
            raise ValueError(MEANS if text.endswith("_se_m_s") else f"is none of {', '.join(known)}")
        return text

    return AfterValidator(check)


Name = Annotated[str, Field(min_length=1), AfterValidator(in_one_line)]
"""What a table calls a column."""


class TableSettings(Settings):
    """Section ``table`` of ``recording.yaml``."""

    file: str | None = Field(
        default=None, min_length=1, description="one table of all subjects, in the cohort"
    )
    sheet: str | None = Field(default=None, min_length=1, description="of a workbook with several")
    header_row: int = Field(default=1, ge=1, le=1000, description="row of the column names, or one before it")
    first_phase: int = Field(default=0, ge=0, le=1, description="number of the first phase")
    statuses: dict[str, Annotated[str, one_of(*STATUSES)]] = Field(
        default_factory=dict, description="the table's word: this project's"
    )
    values: dict[Annotated[str, one_of(*LACKED)], str | int | float] = Field(
        default_factory=dict, description="of columns it lacks"
    )
    copies_allowed: bool = Field(default=False, description="equal beats, repeats or recordings are meant")
    samples: tuple[dict[Annotated[str, one_of(*OF_SAMPLES)], Name], ...] = Field(
        default=(), description="columns of each sample, where samples stand side by side"
    )

    @field_validator("statuses", mode="before")
    @classmethod
    def _words(cls, words: Any) -> Any:  # noqa: ANN401
        """A word may be a number or a truth value: {1: ok, 0: no_wave}."""
        return {str(word): status for word, status in words.items()} if isinstance(words, dict) else words

    @field_validator("values")
    @classmethod
    def _counted(cls, values: dict[str, str | int | float]) -> dict[str, str | int | float]:
        counted = [column for column, value in values.items() if value == COUNTED]
        if wrong := [column for column in counted if column not in COUNTABLE]:
            raise ValueError(f"{wrong[0]}: only {' and '.join(COUNTABLE)} can be counted; give a value")
        if len(counted) > 1:
            raise ValueError(
                f"{' and '.join(counted)} cannot both be counted; name the column of one of them"
            )
        return values

    @field_validator("samples")
    @classmethod
    def _alike(cls, samples: tuple[dict[str, str], ...]) -> tuple[dict[str, str], ...]:
        if any(set(sample) != set(samples[0]) for sample in samples):
            raise ValueError("give the same columns of each sample")
        return samples


class TableLayout(Settings):
    """What ``recording.yaml`` says of the cohort's tables; nothing: they are of this project's own form.

    ``columns`` has by this project's column what the tables call it; ``units`` those that are other than this
    project's names say.
    """

    columns: dict[Annotated[str, one_of(*EVERY_COLUMN)], Name] = Field(default_factory=dict)
    units: dict[Annotated[str, one_of(*UNITS)], str] = Field(default_factory=dict)
    table: TableSettings = TableSettings()

    @field_validator("units")
    @classmethod
    def _known(cls, units: dict[str, str]) -> dict[str, str]:
        for column, unit in units.items():
            if unit not in UNITS[column]:
                raise ValueError(f"{column}: {unit!r} is none of {', '.join(UNITS[column])}")
        return units

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Each column is said once, and one table of all says whose a row is."""
        said = [*self.columns, *self.table.values, *(self.table.samples[0] if self.table.samples else ())]
        if twice := sorted({column for column in said if said.count(column) > 1}):
            raise ValueError(
                f"{', '.join(twice)}: is said twice; keep it under one of columns, values, samples"
            )
        if len(several := [name for name in MEASURED if name in said]) > 1:
            raise ValueError(f"columns: {' and '.join(several)}: name the one that was measured")
        if self.table.file and SUBJECT not in self.columns:
            raise ValueError(
                f"table.file: {self.table.file!r} is one table of all subjects, and no column says whose a "
                "row is; name it under the key `columns.subject`"
            )
        return self

    @property
    def names(self) -> list[str]:
        """What the tables call the columns that the layout names."""
        of_samples = (name for sample in self.table.samples for name in sample.values())
        return [*self.columns.values(), *of_samples]

    @property
    def values(self) -> Mapping[str, str | int | float]:
        """What is said of columns that the tables lack; samples side by side are counted where nothing is."""
        wide = self.table.samples and "sample" not in {*self.columns, *self.table.values}
        return {**self.table.values, **({"sample": COUNTED} if wide else {})}


OWN_FORM: Final = TableLayout()
