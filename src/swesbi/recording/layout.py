"""How a cohort's tables differ from the form of this project, as its ``recording.yaml`` says.

``columns`` names the file's columns, ``units`` their units, ``table`` the rest: one file for all
subjects, the sheet of a workbook, where the names stand, from which number phases count, words of the status,
constants.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import Field, ValidationError

from swesbi.base.settings import Settings
from swesbi.recording.columns import (
    COLUMNS,
    FAILED_STATUSES,
    FREE_COLUMNS,
    MEASURED,
    MODULUS,
    SHEAR_MODULUS,
    SPEED,
    STATUS_OK,
    TIME,
)
from swesbi.recording.columns import STANDARD_ERROR as FREE_STANDARD_ERROR
from swesbi.recording.content import in_one_line
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.units import UNITS

SUBJECT: Final = "subject"
STANDARD_ERROR: Final = "shear_wave_speed_se_m_s"
COUNTED: Final = "counted"
COUNTABLE: Final = ("phase_index", "sample")
ALL_COLUMNS: Final = tuple(dict.fromkeys((*COLUMNS, *FREE_COLUMNS)))
STATUSES: Final = (STATUS_OK, *FAILED_STATUSES)
WIDE: Final = (SPEED, MODULUS, SHEAR_MODULUS, "fit_r2", "status")
"""Columns of which a table may have several, one a sample."""


class TableSettings(Settings):
    """Section ``table`` of ``recording.yaml``."""

    file: str | None = Field(
        default=None, min_length=1, description="one table of all subjects, in the cohort"
    )
    sheet: str | None = Field(default=None, min_length=1, description="of a workbook with several")
    header_row: int | None = Field(default=None, ge=1, le=1000, description="row of the column names")
    first_phase: int = Field(default=0, ge=0, le=1, description="number of the first phase")
    statuses: dict[str, str] = Field(default_factory=dict, description="the table's word: this project's")
    values: dict[str, str | int | float] = Field(default_factory=dict, description="of columns it lacks")


class TableLayout(Settings):
    """What ``recording.yaml`` says of the cohort's tables; nothing: they are of this project's own form.

    Attributes:
        columns: This project's column: what the tables call it, or several names, or a pattern with ``*``.
        units: Units of those columns that are in another than their names say.
        table: The rest.
    """

    columns: dict[str, str | tuple[str, ...]] = Field(default_factory=dict)
    units: dict[str, str] = Field(default_factory=dict)
    table: TableSettings = TableSettings()

    @property
    def is_own(self) -> bool:
        """Whether tables are of this project's own form."""
        return self == TableLayout()

    @property
    def measured(self) -> str:
        """The column of what was measured, where the layout says which."""
        return next((name for name in MEASURED if name in self.columns), SPEED)

    @property
    def values(self) -> Mapping[str, str | int | float]:
        """What is said of columns that the tables lack; samples side by side are counted where nothing is."""
        unsaid = "sample" not in self.columns and "sample" not in self.table.values
        wide = unsaid and _is_several(self.source(self.measured))
        return {**self.table.values, **({"sample": COUNTED} if wide else {})}

    def source(self, column: str) -> str | tuple[str, ...]:
        """Return what the tables call a column of this project: as it does, where nothing is said."""
        names = self.columns.get(column, column)
        return in_one_line(names) if isinstance(names, str) else tuple(map(in_one_line, names))


def layout_of(plain: Mapping[str, Any], path: Path) -> TableLayout:
    """Return the layout that the content of ``recording.yaml`` describes.

    Raises:
        RecordingError: It names what is not known, or what the inference cannot take; lists every problem.
    """
    said = {key: plain[key] for key in TableLayout.model_fields if plain.get(key) is not None}
    try:
        layout = TableLayout.from_plain(said)
    except ValidationError as error:
        raise RecordingError(*(_problem(path, details) for details in error.errors())) from error
    raise_any([*_columns(path, layout), *_units(path, layout), *_table(path, layout)])
    return layout


def _problem(path: Path, details: Any) -> Problem:  # noqa: ANN401
    key = ".".join(map(str, details["loc"][:2]))
    remedy = "docs/own-data.md shows the keys"
    return Problem(str(path), f"under the key `{key}`: {details['msg']}", remedy, value=str(details["input"]))


def _columns(path: Path, layout: TableLayout) -> list[Problem]:
    known = (SUBJECT, *ALL_COLUMNS, *MEASURED[1:])
    problems = []
    for column, names in layout.columns.items():
        key, value = f"columns.{column}", str(names)
        if column == STANDARD_ERROR:
            reason = f"under the key `{key}`: means with standard errors are not taken"
            remedy = (
                "errors are estimated from repeats: give the samples themselves, a row or a column each; of "
                f"a free-running recording, with {TIME}, the column is {FREE_STANDARD_ERROR}"
            )
            problems.append(Problem(str(path), reason, remedy, value=value))
        elif column not in known:
            reason, remedy = f"under the key `{key}` is for no column", f"those are {', '.join(known)}"
            problems.append(Problem(str(path), reason, remedy, value=value))
        elif _is_several(names) and column not in WIDE:
            reason = f"under the key `{key}` names several columns"
            remedy = f"name one; only {', '.join(WIDE)} may have one a sample"
            problems.append(Problem(str(path), reason, remedy, value=value))
    if len(several := [name for name in MEASURED if name in layout.columns]) > 1:
        reason = f"under the key `columns` names {' and '.join(several)}"
        problems.append(Problem(str(path), reason, "name the one that was measured"))
    if layout.table.file and SUBJECT not in layout.columns:
        reason = "under the key `table.file` is one table of all subjects, and no column says whose a row is"
        remedy = "name it under the key `columns.subject`"
        problems.append(Problem(str(path), reason, remedy, value=layout.table.file))
    return problems


def _is_several(names: str | tuple[str, ...]) -> bool:
    return not isinstance(names, str) or "*" in names


def _units(path: Path, layout: TableLayout) -> list[Problem]:
    problems = []
    for column, unit in layout.units.items():
        allowed = UNITS.get(column)
        if allowed is None:
            reason, remedy = f"under the key `units.{column}` is of no column with a unit", ", ".join(UNITS)
            problems.append(Problem(str(path), reason, f"those are {remedy}", value=unit))
        elif unit not in allowed:
            reason, remedy = f"under the key `units.{column}` is not known", f"write {', '.join(allowed)}"
            problems.append(Problem(str(path), reason, remedy, value=unit))
    return problems


def _table(path: Path, layout: TableLayout) -> list[Problem]:
    problems = []
    table = layout.table
    for column, value in table.values.items():
        if column not in ALL_COLUMNS or column in layout.columns:
            reason = f"under the key `table.values.{column}` is for no column that the tables lack"
            remedy = f"those are {', '.join(ALL_COLUMNS)}"
            problems.append(Problem(str(path), reason, remedy, value=str(value)))
        elif value == COUNTED and column not in COUNTABLE:
            reason = f"under the key `table.values.{column}`: only {' and '.join(COUNTABLE)} can be counted"
            problems.append(Problem(str(path), reason, "give a value", value=str(value)))
    if all(table.values.get(column) == COUNTED for column in COUNTABLE):
        reason = f"under the key `table.values`: {' and '.join(COUNTABLE)} cannot both be counted"
        problems.append(Problem(str(path), reason, "name the column of one of them"))
    for word, status in table.statuses.items():
        if status not in STATUSES:
            reason = f"under the key `table.statuses.{word}` is none of {', '.join(STATUSES)}"
            problems.append(Problem(str(path), reason, "write one of them", value=status))
    return problems
