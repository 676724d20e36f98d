"""What the pressures of a cuff add, as the page shows it. matplotlib is not imported."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import pandas as pd

from swesbi.checks.pressures import RESISTANCE
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import PEAK_ACTIVE, PHI_NAMES
from swesbi.report.columns import each_parameter, named
from swesbi.report.numbers import MISSING, fixed, quantity
from swesbi.report.results import wide
from swesbi.report.table import Table

ROWS: Final = (*PHI_NAMES, PEAK_ACTIVE.name, RESISTANCE, TIME_CONSTANT, CAPACITANCE, VOLUME_FACTOR)
"""Quantities of the page, in their order; the table has all."""
NOTE: Final = (
    "Over the subjects with cuff pressures. Width: log upper over lower limit of the interval with them, "
    "over that without. Shift: log of the medians' ratio, in widths of the interval without. The stressed "
    "volume is free with pressures alone."
)


def pressures_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a quantity: widths with over without and shifts, over the subjects."""
    by_quantity = table.groupby("quantity")[["width_ratio", "shift_in_widths"]].agg(_span)
    frame = by_quantity.loc[[name for name in ROWS if name in by_quantity.index]].reset_index()
    return Table(
        f"What pressures add: {table['subject'].nunique()} {cohort_title}.",
        frame,
        named("quantity", "width_ratio", "shift_in_widths"),
        NOTE,
    )


def _span(values: pd.Series) -> str:
    known = values.dropna()
    if known.empty:
        return MISSING
    low, middle, high = (fixed(float(known.quantile(level)), 2) for level in (0.0, 0.5, 1.0))
    return f"{middle} ({low} to {high})"


def subjects_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a subject: its pressures, what they tell of the circulation, how that was obtained."""
    widths = each_parameter("width", (RESISTANCE, TIME_CONSTANT))
    columns = named("subject", "cuff", *widths, f"with {VOLUME_FACTOR}", "efficiency", "pressures_sampler")
    return Table(f"Answers with pressures ({cohort_title}).", wide(table, ["subject"], "quantity"), columns)


def in_words(table: pd.DataFrame) -> Iterator[str]:
    """Yield what pressures tell of the circulation, in sentences."""
    for name in (RESISTANCE, TIME_CONSTANT):
        ratio = table.loc[table["quantity"] == name, "width_ratio"].dropna()
        if len(ratio):
            yield f"{quantity(name)}: intervals {fixed(float(ratio.median()), 2)} times as wide (median)"
