"""What the pressures of a cuff add, as page and documentation show it. matplotlib is not imported."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import pandas as pd

from swesbi.checks.pressures import RESISTANCE
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import NUISANCES, PEAK_ACTIVE, PHI
from swesbi.report.numbers import MISSING, fixed
from swesbi.report.results import columns_of, wide
from swesbi.report.table import Column, Table, words
from swesbi.report.tables.population import SAMPLER_NAMES
from swesbi.report.tables.subjects import SUBJECT

ROWS: Final = (
    *(each.name for each in PHI), PEAK_ACTIVE.name, RESISTANCE, TIME_CONSTANT, CAPACITANCE, VOLUME_FACTOR,
)  # fmt: skip
"""Quantities of the page and the documentation, in their order; the table has all."""
TEXTS: Final = {parameter.name: parameter.text for parameter in (*PHI, *NUISANCES)} | {
    PEAK_ACTIVE.name: "peak active stiffness",
    CAPACITANCE: "C_s",
}
NOTE: Final = (
    "Over the subjects with cuff pressures. Width: log upper over lower limit of the interval with them, "
    "over that without. Shift: log of the medians' ratio, in widths of the interval without. The stressed "
    "volume is free with pressures alone."
)


def pressures_of(table: pd.DataFrame | None, experiment: str) -> pd.DataFrame | None:
    """Return the rows of an experiment in ``pressures.csv``, if there is one and has any."""
    if table is None or experiment not in set(table["experiment"]):
        return None
    return table[table["experiment"] == experiment]


def pressures_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a quantity: widths with over without and shifts, over the subjects.

    Args:
        table: ``pressures.csv``, of one experiment.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    columns = (
        words("quantity", "Quantity", TEXTS),
        Column("width_ratio", "Width with over without", "median (least to largest)"),
        Column("shift_in_widths", "Shift", "widths, median (least to largest)"),
    )
    by_quantity = table.groupby("quantity")[["width_ratio", "shift_in_widths"]].agg(_span)
    frame = by_quantity.loc[[name for name in ROWS if name in by_quantity.index]].reset_index()
    caption = f"What pressures add: {table['subject'].nunique()} {cohort_title}."
    return Table(caption, frame, columns, NOTE)


def _span(values: pd.Series) -> str:
    known = values.dropna()
    if known.empty:
        return MISSING
    low, middle, high = (fixed(float(known.quantile(level)), 2) for level in (0.0, 0.5, 1.0))
    return f"{middle} ({low} to {high})"


def subjects_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a subject: its pressures, what they tell of the circulation, how that was obtained."""
    columns = (
        SUBJECT,
        Column(("sbp_mmhg", "dbp_mmhg"), "Cuff", "mmHg", "{:.0f} / {:.0f}".format),
        *(
            Column(f"{name}_width_ratio", f"Width of {TEXTS[name]}", "with over without", "2f")
            for name in (RESISTANCE, TIME_CONSTANT)
        ),
        Column(columns_of(f"{VOLUME_FACTOR}_with"), TEXTS[VOLUME_FACTOR], "median (interval)", "2f"),
        Column("efficiency", "Efficiency", "%", "0%"),
        words(("sampler", "converged"), "Draws by", _sampler),
    )
    return Table(f"Answers with pressures ({cohort_title}).", wide(table, ["subject"], "quantity"), columns)


def _sampler(name: str, converged: bool) -> str:
    return SAMPLER_NAMES[name] if converged else f"{SAMPLER_NAMES[name]}, not converged"


def in_words(table: pd.DataFrame) -> Iterator[str]:
    """Yield what pressures tell of the circulation, in sentences."""
    for name in (RESISTANCE, TIME_CONSTANT):
        ratio = table.loc[table["quantity"] == name, "width_ratio"].dropna()
        if len(ratio):
            yield f"{TEXTS[name]}: intervals {fixed(float(ratio.median()), 2)} times as wide (median)"
