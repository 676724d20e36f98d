"""Rows of medians with intervals: on given axes, or a whole figure with a panel a quantity."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.base.arrays import FloatArray
from swesbi.report.figures.style import (
    PRIOR,
    TEXT_WIDTH_IN,
    few_ticks,
    in_percent,
    new_figure,
    plain,
    plain_decades,
    shared_legend,
    style,
)

ENDS: Final = ("low", "median", "high")
ROW_HEIGHT_IN: Final = 0.19
LEAST_HEIGHT_IN: Final = 0.9
PANEL_FRAME_IN: Final = 0.65
FRAME_IN: Final = 0.55
SPREAD: Final = 0.68
"""How much of a row the lanes of its series share."""
LEGEND_SIZE: Final = 3.0
MOST_ROWS: Final = 40
"""Rows that a reader can tell apart in one panel."""


@dataclass(frozen=True)
class Series:
    """How one series of intervals looks.

    Attributes:
        color: Of its marks and lines.
        label: Its entry in the legend; none where empty.
        marker: The mark of a median.
        filled: Whether the mark is filled.
        lane: Series of the same lane share a line of each row; by itself each has its own.
        alpha: Opacity of the line from end to end; marks are opaque.
        size: Of the marks, in points.
        width: Of the lines, in points.
    """

    color: str
    label: str
    marker: str = "o"
    filled: bool = True
    lane: str | None = None
    alpha: float = 1.0
    size: float = 2.6
    width: float = 0.9


@dataclass(frozen=True)
class Panel:
    """One panel of a forest.

    Attributes:
        title: What is shown, with its unit where ``label`` has none.
        label: Below the axis.
        scale: Of the axis: plain numbers, logarithmic, or percent of fractions.
        mark: A value to compare with, as a dashed line.
    """

    title: str
    label: str = ""
    scale: Literal["linear", "log", "percent"] = "linear"
    mark: float | None = None


def intervals(
    axes: Axes,
    rows: pd.DataFrame,
    look: Mapping[str, Series],
    *,
    order: Sequence[str] | None = None,
    of: tuple[str, str, str] = ENDS,
    upright: bool = False,
) -> None:
    """Draw lower end, median and upper end of every row on given axes.

    Args:
        axes: Where to draw. Only what is drawn is changed: scales, limits and ticks are the caller's.
        rows: Columns ``row``, ``series`` and those of ``of``. A row without numbers is left out.
        look: Of each series; a series that has no look is not drawn, one without rows has no legend.
        order: Names of ``row`` from 0 on; a name that is not there is not drawn. None: ``row`` is a number.
        of: Columns of the lower end, the median and the upper end.
        upright: Whether rows stand side by side along x, with intervals along y.
    """
    lanes = list(dict.fromkeys(series.lane or name for name, series in look.items()))
    for name, series in look.items():
        part = rows[rows["series"] == name]
        place = part["row"] if order is None else part["row"].map({row: i for i, row in enumerate(order)})
        step = SPREAD / len(lanes) if order is not None else 0.0
        at = place.to_numpy(float) + step * (lanes.index(series.lane or name) - 0.5 * (len(lanes) - 1))
        low, median, high = (part[column].to_numpy(float) for column in of)
        shown = np.isfinite(median) & np.isfinite(at)
        if shown.any():
            _draw(axes, at[shown], (low[shown], median[shown], high[shown]), series, upright=upright)


def _draw(
    axes: Axes,
    at: FloatArray,
    ends: tuple[FloatArray, FloatArray, FloatArray],
    series: Series,
    *,
    upright: bool,
) -> None:
    low, median, high = ends
    lines = axes.vlines if upright else axes.hlines
    lines(at, low, high, color=series.color, lw=series.width, alpha=series.alpha)
    mark: dict[str, Any] = {
        "color": series.color,
        "mfc": series.color if series.filled else "white",
        "mew": 0.0 if series.filled else 0.8,
        "ls": "none",
        "marker": series.marker,
    }
    x, y = (at, median) if upright else (median, at)
    axes.plot(x, y, ms=series.size, **mark)
    if series.label:
        axes.plot([], [], ms=max(series.size, LEGEND_SIZE), label=plain(series.label), **mark)


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows of a forest from top to bottom, whatever they are called."""
    axes.set_yticks(range(len(names)), [plain(name) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)


def finish_panel(axes: Axes, panel: Panel) -> None:
    """Give axes the title, label, scale and mark of a panel, with three ticks or more."""
    axes.tick_params(axis="y", length=0)
    axes.set_title(panel.title)
    axes.set_xlabel(panel.label)
    if panel.mark is not None:
        axes.axvline(panel.mark, color=PRIOR, lw=0.8, ls="--", zorder=0)
    if panel.scale == "log":
        axes.set_xscale("log")
        plain_decades(axes.xaxis)
        return
    axes.xaxis.set_major_locator(few_ticks())
    if panel.scale == "percent":
        in_percent(axes.xaxis)


def forest(
    rows: pd.DataFrame,
    panels: Mapping[str, Panel],
    look: Mapping[str, Series],
    *,
    title: str,
    order: Sequence[str] | None = None,
    names: Mapping[str, str] | None = None,
    of: tuple[str, str, str] = ENDS,
    columns: int = 4,
    width_in: float = 1.45 * TEXT_WIDTH_IN,
    entries_a_row: int = 4,
    behind: Callable[[Axes, str], None] | None = None,
) -> Figure:
    """Draw a panel a quantity with a row a subject, group or stratum, and one legend below.

    Args:
        rows: Columns ``panel``, ``row``, ``series`` and those of ``of``, as for :func:`intervals`.
        panels: By the values of ``panel``, in the order in which they are drawn.
        look: Of each series.
        title: Of the figure.
        order: The rows from top to bottom; None: as they come.
        names: What rows are called in the figure, where not by their own name.
        of: Columns of the lower end, the median and the upper end.
        columns: Most panels beside each other.
        width_in: Of the figure, in inches.
        entries_a_row: Of the legend.
        behind: Draws more into a panel, given its axes and its name.

    Raises:
        ValueError: There is no row.
    """
    order = list(dict.fromkeys(rows["row"])) if order is None else list(order)
    look = {name: series for name, series in look.items() if (rows["series"] == name).any()}
    if not order or not panels:
        raise ValueError("no row to draw: the table is empty")
    across = min(columns, len(panels))
    down = -(-len(panels) // across)
    height = max(LEAST_HEIGHT_IN, ROW_HEIGHT_IN * len(order)) + PANEL_FRAME_IN
    with style():
        figure = new_figure(width_in, down * height + FRAME_IN)
        grid = figure.subplots(down, across, sharey=True, squeeze=False)
        for spare in grid.flat[len(panels) :]:
            spare.remove()
        shown = list(grid.flat[: len(panels)])
        for axes, (name, panel) in zip(shown, panels.items(), strict=True):
            intervals(axes, rows[rows["panel"] == name], look, order=order, of=of)
            if behind is not None:
                behind(axes, name)
            finish_panel(axes, panel)
        for axes in shown[::across]:
            name_rows(axes, [(names or {}).get(name, name) for name in order])
        figure.suptitle(title, fontsize=7.5)
        shared_legend(figure, shown, entries_a_row)
    return figure
