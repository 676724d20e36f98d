"""What variants of the configuration move: medians and widths, a point a subject."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from swesbi.checks.settings import BASE
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.style import PRIOR, SERIES, TEXT_WIDTH_IN, drawing, plain

ROW_HEIGHT_IN: Final = 0.17
FRAME_HEIGHT_IN: Final = 1.3
MARKERS: Final = "osD^vPX*"


def draw_sensitivity(table: pd.DataFrame, cohort_title: str) -> Figure:
    """Draw shifts (above) and width ratios (below) of every variant, a column a parameter."""
    shown = table[table["variant"] != BASE]
    names = list(dict.fromkeys(shown["label"]))
    with drawing(TEXT_WIDTH_IN * 1.35, 2 * (ROW_HEIGHT_IN * len(names)) + FRAME_HEIGHT_IN) as figure:
        axes = figure.subplots(2, len(THETA_NAMES), sharey=True)
        for column, (parameter, symbol) in enumerate(zip(THETA_NAMES, THETA_SYMBOLS, strict=True)):
            rows = shown[shown["parameter"] == parameter]
            _subject_points(axes[0, column], rows, names, "shift_in_widths")
            axes[0, column].axvspan(-0.5, 0.5, color="#EDEDED", zorder=0)
            axes[0, column].set_title(symbol)
            _subject_points(axes[1, column], rows, names, "width_ratio")
            _ratios(axes[1, column], rows["width_ratio"].to_numpy())
        middle = (len(THETA_NAMES) - 1) // 2
        axes[0, middle].set_xlabel(
            "shift of the median, in widths of the base's interval (grey: within a half)"
        )
        axes[1, middle].set_xlabel("width of the interval over the base's")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        title = f"subject ({plain(cohort_title)})"
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), title=title)
    return figure


def _ratios(axes: Axes, ratios: NDArray[np.float64]) -> None:
    """Show ratios on a logarithmic axis that reaches a factor of two both ways at least."""
    reach = max(2.0, 1.1 * float(np.exp(np.abs(np.log(ratios)).max())))
    axes.set_xscale("log", base=2)
    axes.set_xlim(1.0 / reach, reach)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.axvline(1.0, color=PRIOR, linewidth=0.6)


def _subject_points(axes: Axes, rows: pd.DataFrame, names: list[str], column: str) -> None:
    """Draw a column of rows, each at the height of its label among ``names``, a marker a subject."""
    subjects = list(dict.fromkeys(rows["subject"]))
    offsets = np.linspace(-0.28, 0.28, len(subjects)) if len(subjects) > 1 else np.zeros(1)
    for number, (subject, offset) in enumerate(zip(subjects, offsets, strict=True)):
        points = rows[rows["subject"] == subject]
        height = [names.index(label) + offset for label in points["label"]]
        look: dict[str, Any] = {
            "color": SERIES[number % len(SERIES)],
            "marker": MARKERS[number % len(MARKERS)],
        }
        axes.plot(points[column], height, linestyle="none", markersize=2.4, label=subject, **look)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(axis="y", linewidth=0.3, color="#DDDDDD")
