"""What variants of the configuration move: medians and widths, a point a subject."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from studies.subject_points import subject_points
from swesbi.checks.settings import BASE
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.style import PRIOR, TEXT_WIDTH_IN, new_figure, plain, style

ROW_HEIGHT_IN: Final = 0.17
FRAME_HEIGHT_IN: Final = 1.3


def draw_sensitivity(table: pd.DataFrame, cohort_title: str) -> Figure:
    """Draw shifts (above) and width ratios (below) of every variant, a column a parameter.

    Args:
        table: The rows of ``sensitivity.csv``.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    shown = table[table["variant"] != BASE]
    names = list(dict.fromkeys(shown["label"]))
    with style():
        figure = new_figure(TEXT_WIDTH_IN * 1.35, 2 * (ROW_HEIGHT_IN * len(names)) + FRAME_HEIGHT_IN)
        axes = figure.subplots(2, len(THETA_NAMES), sharey=True)
        for column, (parameter, symbol) in enumerate(zip(THETA_NAMES, THETA_SYMBOLS, strict=True)):
            rows = shown[shown["parameter"] == parameter]
            subject_points(axes[0, column], rows, names, "shift_in_widths")
            axes[0, column].axvspan(-0.5, 0.5, color="#EDEDED", zorder=0)
            axes[0, column].set_title(symbol)
            subject_points(axes[1, column], rows, names, "width_ratio")
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
