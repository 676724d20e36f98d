"""The validation: coverage of each quantity by generator, of all answered and those not contradicted."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.parameters import DERIVED, THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    EXCLUDED_POSTERIOR,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    in_percent,
    new_figure,
    shared_legend,
    style,
)
from swesbi.report.numbers import as_percent
from swesbi.report.tables.validation_outcomes import NOT_TESTED, OF_EVERY_GENERATOR, QUANTITIES, REACHED

WIDTH_IN: Final = 2.0 * TEXT_WIDTH_IN
COLUMNS: Final = 5
ROW_HEIGHT_IN: Final = 0.2
FRAME_HEIGHT_IN: Final = 0.6
OFFSET: Final = 0.16
TITLES: Final = dict(zip(THETA_NAMES, THETA_SYMBOLS, strict=True)) | {
    quantity.name: quantity.meaning for quantity in DERIVED
}
LOOKS: Final[dict[str, dict[str, Any]]] = {
    "coverage": {"color": EXCLUDED_POSTERIOR, "marker": "o", "label": "all answered"},
    "coverage_not_contradicted": {"color": POSTERIOR, "marker": "s", "label": "not contradicted"},
}


def draw_validation(table: pd.DataFrame, interval: float) -> Figure:
    """Draw coverage with its interval, a panel a quantity and a row a generator, those together last.

    Where fewer hearts are not contradicted than are asked for, the row says "not tested". What is asked of
    peak active stiffness and k_SR, that an interval reaches the grey area, is asked of no other quantity.

    Args:
        table: The rows of ``validation.csv``.
        interval: Mass of the intervals whose coverage is shown.
    """
    generators = list(dict.fromkeys(table["generator"]))
    rows = -(-len(QUANTITIES) // COLUMNS)
    with style():
        height = rows * (ROW_HEIGHT_IN * len(generators) + FRAME_HEIGHT_IN)
        figure = new_figure(WIDTH_IN, height)
        axes = figure.subplots(rows, COLUMNS, sharex=True, sharey=True).ravel()
        for panel, quantity in zip(axes, QUANTITIES, strict=True):
            _panel(panel, table[table["quantity"] == quantity], generators, interval)
            panel.set_title(TITLES[quantity])
            if quantity in OF_EVERY_GENERATOR:
                panel.axvspan(REACHED, 1.0, color=EXCLUDED_BACKGROUND, zorder=0)
        axes[0].set_yticks(range(len(generators)), generators)
        axes[0].set_ylim(len(generators) - 0.5, -0.5)
        axes[0].set_xlim(-0.02, 1.02)
        in_percent(axes[0].xaxis)
        figure.suptitle(
            f"Hearts of other generators: share whose truth lies in the "
            f"{as_percent(interval)} interval (grey: to be reached by blue)",
            fontsize=7.5,
        )
        shared_legend(figure, axes, len(LOOKS))
    return figure


def _panel(axes: Axes, rows: pd.DataFrame, generators: list[str], interval: float) -> None:
    axes.axvline(interval, color=PRIOR, linewidth=0.6, linestyle="--", zorder=0)
    at = np.array([generators.index(name) for name in rows["generator"]], dtype=np.float64)
    for column, side in zip(LOOKS, (-1.0, 1.0), strict=True):
        _points(axes, rows, column, at + side * OFFSET)
    for height, tested in zip(at, rows["tested"], strict=True):
        if tested == NOT_TESTED:
            axes.text(0.02, height + OFFSET, NOT_TESTED, color=PRIOR, fontsize=5.5, va="center")


def _points(axes: Axes, rows: pd.DataFrame, column: str, height: np.ndarray[Any, Any]) -> None:
    share = rows[column].to_numpy(dtype=np.float64)
    limits = [rows[f"{column}_{end}"].to_numpy(dtype=np.float64) for end in ("low", "high")]
    axes.errorbar(
        share, height, xerr=np.abs(np.stack([share - limits[0], limits[1] - share])), linestyle="none",
        markersize=2.8, elinewidth=0.7, **LOOKS[column],
    )  # fmt: skip
