"""How a table differs from the form of this project, as ``recording.yaml`` says.

``columns`` names the table's columns, ``units`` their units, ``table`` the rest: one file for all subjects,
the sheet of a workbook, where the names stand, from which number phases count, words of the status,
constants, and columns of samples that stand side by side.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Self

from pydantic import AfterValidator, Field, field_validator, model_validator

from swesbi.base.settings import Settings
from swesbi.recording.tables.columns import (
    COLUMNS,
    EVERY_COLUMN,
    FREE_COLUMNS,
    MEASURED,
    PHASE,
    STATUSES,
    SUBJECT,
    TIME,
    UNITS,
)
from swesbi.recording.tables.table import in_one_line

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
