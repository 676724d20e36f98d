"""What the pressures of a cuff add, as page and documentation show it. matplotlib is not imported."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pandas as pd

from swesbi.checks.pressures import COLUMNS, RESISTANCE
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import NUISANCES, PHI, SHOWN
from swesbi.report.csv import checked
from swesbi.report.numbers import MISSING, fixed, percent
from swesbi.report.results import records
from swesbi.report.table import Column, Row, Table, words
from swesbi.report.tables.population import SAMPLER_NAMES

ROWS: Final = (
    *(parameter.name for parameter in PHI), SHOWN.name, RESISTANCE, TIME_CONSTANT, CAPACITANCE, VOLUME_FACTOR,
)  # fmt: skip
"""Quantities of the page and the documentation, in their order; the table has all."""
TEXTS: Final = {parameter.name: parameter.text for parameter in (*PHI, *NUISANCES)} | {
    SHOWN.name: "shown stiffness",
    CAPACITANCE: "C_s",
}
NOTE: Final = (
    "Over the subjects with cuff pressures. Width: log upper over lower limit of the interval with them, "
    "over that without. Shift: log of the medians' ratio, in widths of the interval without. The stressed "
    "volume is free with pressures alone."
)


def read_pressures(path: Path) -> pd.DataFrame:
    """Read ``pressures.csv``.

    Raises:
        ArtefactError: A column or every row is missing.
        FileNotFoundError: There is no such file.
    """
    return checked(pd.read_csv(path, converters={"subject": str}), path, COLUMNS, row="subject")


def pressures_of(paths: Sequence[Path], experiment: str) -> pd.DataFrame | None:
    """Return the rows of an experiment in the table, if there is one and has any.

    Args:
        paths: ``pressures.csv``, or none.
        experiment: Name of the experiment.

    Raises:
        ArtefactError: It is no such table.
    """
    tables = [read_pressures(path) for path in paths]
    rows = [table[table["experiment"] == experiment] for table in tables]
    return next((part for part in rows if len(part)), None)


def pressures_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a quantity: widths with over without and shifts, over the subjects.

    Args:
        table: ``pressures.csv``, of one experiment.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    columns = (
        *words("Quantity"),
        Column("Width with over without", "median (least to largest)"),
        Column("Shift", "widths, median (least to largest)"),
    )
    rows = tuple(
        Row((TEXTS[name], _span(rows["width_ratio"]), _span(rows["shift_in_widths"])))
        for name in ROWS
        if len(rows := table[table["quantity"] == name])
    )
    subjects = table["subject"].nunique()
    return Table(f"What pressures add: {subjects} {cohort_title}.", columns, rows, NOTE)


def _span(values: pd.Series) -> str:
    known = values.dropna()
    if known.empty:
        return MISSING
    low, middle, high = (fixed(float(known.quantile(level)), 2) for level in (0.0, 0.5, 1.0))
    return f"{middle} ({low} to {high})"


def subjects_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a subject: its pressures, what they tell of the circulation, how that was obtained."""
    columns = (
        *words("Subject"),
        Column("Cuff", "mmHg"),
        *(Column(f"Width of {TEXTS[name]}", "with over without") for name in (RESISTANCE, TIME_CONSTANT)),
        Column(TEXTS[VOLUME_FACTOR], "median (interval)"),
        Column("Efficiency", "%"),
        *words("Draws by"),
    )
    rows = tuple(_subject(rows) for _, rows in table.groupby("subject", sort=False))
    return Table(f"Answers with pressures ({cohort_title}).", columns, rows)


def _subject(rows: pd.DataFrame) -> Row:
    by_name: dict[str, Mapping[Hashable, Any]] = {str(row["quantity"]): row for row in records(rows)}
    first = next(iter(by_name.values()))
    sampler = SAMPLER_NAMES[str(first["sampler"])]
    return Row(
        (
            str(first["subject"]),
            f"{first['sbp_mmhg']:.0f} / {first['dbp_mmhg']:.0f}",
            *(_ratio(by_name, name) for name in (RESISTANCE, TIME_CONSTANT)),
            _limits(by_name[VOLUME_FACTOR]),
            percent(float(first["efficiency"]), 0),
            sampler if first["converged"] else f"{sampler}, not converged",
        )
    )


def _ratio(by_name: Mapping[str, Mapping[Hashable, Any]], name: str) -> str:
    return fixed(float(by_name[name]["width_ratio"]), 2) if name in by_name else MISSING


def _limits(row: Mapping[Hashable, Any]) -> str:
    low, median, high = (fixed(float(row[f"with_{name}"]), 2) for name in ("low", "median", "high"))
    return f"{median} ({low} to {high})"


def in_words(table: pd.DataFrame) -> Iterator[str]:
    """Yield what pressures tell of the circulation, in sentences."""
    for name in (RESISTANCE, TIME_CONSTANT):
        ratio = table.loc[table["quantity"] == name, "width_ratio"].dropna()
        if len(ratio):
            yield f"{TEXTS[name]}: intervals {fixed(float(ratio.median()), 2)} times as wide (median)"
