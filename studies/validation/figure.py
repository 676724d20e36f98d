"""The validation: coverage of each quantity by generator, of all answered and those not contradicted."""

from __future__ import annotations

from textwrap import fill
from typing import Final

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.parameters import DERIVED, THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.forest import Panel, Series, forest
from swesbi.report.figures.style import EXCLUDED_BACKGROUND, EXCLUDED_POSTERIOR, POSTERIOR, PRIOR
from swesbi.report.numbers import as_percent
from swesbi.report.tables.validation import NOT_TESTED, OF_EVERY_GENERATOR, QUANTITIES, REACHED

COLUMNS: Final = 5
WIDEST: Final = 18  # characters of a title
TITLES: Final = dict(zip(THETA_NAMES, THETA_SYMBOLS, strict=True)) | {
    quantity.name: fill(quantity.meaning, WIDEST) for quantity in DERIVED
}
LOOKS: Final = {
    "coverage": Series(EXCLUDED_POSTERIOR, "all answered"),
    "coverage_not_contradicted": Series(POSTERIOR, "not contradicted", marker="s"),
}


def draw_validation(table: pd.DataFrame, interval: float) -> Figure:
    """Draw coverage with its interval, a panel a quantity and a row a generator, those together last.

    A row says "not tested" where fewer hearts are not contradicted than asked for. Only of peak active
    stiffness and k_SR is it asked that an interval reaches the grey area.
    """
    generators = list(dict.fromkeys(table["generator"]))
    ends = {"low": "{}_low", "median": "{}", "high": "{}_high"}
    rows = [
        table.assign(
            panel=table["quantity"],
            row=table["generator"],
            series=name,
            **{end: table[column.format(name)] for end, column in ends.items()},
        )
        for name in LOOKS
    ]

    def behind(axes: Axes, quantity: str) -> None:
        axes.set_xlim(-0.02, 1.02)
        if quantity in OF_EVERY_GENERATOR:
            axes.axvspan(REACHED, 1.0, color=EXCLUDED_BACKGROUND, zorder=0)
        untested = table[(table["quantity"] == quantity) & (table["tested"] == NOT_TESTED)]
        for at in map(generators.index, untested["generator"]):
            axes.text(0.02, at + 0.16, NOT_TESTED, color=PRIOR, fontsize=5.5, va="center")

    return forest(
        pd.concat(rows),
        {name: Panel(TITLES[name], scale="percent", mark=interval) for name in QUANTITIES},
        LOOKS,
        title="Hearts of other generators: share whose truth lies in the "
        f"{as_percent(interval)} interval (grey: to be reached by blue)",
        names={name: name for name in generators},
        columns=COLUMNS,
        behind=behind,
    )
