"""Rows of medians with intervals: on given axes, or a whole figure with a panel a quantity."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.report.figures.style import (
    PRIOR,
    WIDE_IN,
    drawing,
    few_ticks,
    in_percent,
    panel_grid,
    plain,
    plain_decades,
    shared_legend,
)

ENDS: Final = ("low", "median", "high")
ROW_HEIGHT_IN: Final = 0.19
PANEL_FRAME_IN: Final = 0.65
SPREAD: Final = 0.68
"""How much of a row the lanes of its series share."""
MOST_ROWS: Final = 40
"""Rows that a reader can tell apart in one panel."""


@dataclass(frozen=True)
class Series:
    """How one series of intervals looks; its marks are opaque, sizes and widths in points.

    Series of the same ``lane`` share a line of each row, by itself each has its own. An empty ``label`` has
    no entry in the legend.
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
    """One panel of a forest: title, label of the axis, its scale, and a value to compare with, dashed."""

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
    """Draw the columns ``of`` (lower end, median, upper end) of every row, by ``series``, on given axes.

    A row without numbers is left out, and so are a series without look and a ``row`` not in ``order``.
    Without ``order``, ``row`` is a number. ``upright`` rows stand side by side along x.
    """
    lanes = list(dict.fromkeys(series.lane or name for name, series in look.items()))
    for name, series in look.items():
        part = rows[rows["series"] == name]
        place = part["row"] if order is None else part["row"].map({row: i for i, row in enumerate(order)})
        step = SPREAD / len(lanes) if order is not None else 0.0
        at = place.to_numpy(float) + step * (lanes.index(series.lane or name) - 0.5 * (len(lanes) - 1))
        low, median, high = (part[column].to_numpy(float) for column in of)
        shown = np.isfinite(median) & np.isfinite(at)
        if not shown.any():
            continue
        lines = axes.vlines if upright else axes.hlines
        lines(at[shown], low[shown], high[shown], color=series.color, lw=series.width, alpha=series.alpha)
        mark: dict[str, Any] = {
            "color": series.color,
            "mfc": series.color if series.filled else "white",
            "mew": 0.0 if series.filled else 0.8,
            "ls": "none",
            "marker": series.marker,
        }
        x, y = (at, median) if upright else (median, at)
        axes.plot(x[shown], y[shown], ms=series.size, **mark)
        if series.label:
            axes.plot([], [], ms=max(series.size, 3.0), label=plain(series.label), **mark)


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows of a forest from top to bottom."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def finish_panel(axes: Axes, panel: Panel) -> None:
    """Give axes the title, label, scale and mark of a panel, with three ticks or more."""
    axes.tick_params(axis="y", length=0)
    axes.set(title=panel.title, xlabel=panel.label)
    if panel.mark is not None:
        axes.axvline(panel.mark, color=PRIOR, lw=0.8, ls="--", zorder=0)
    if panel.scale == "log":
        plain_decades(axes.xaxis)
    else:
        axes.xaxis.set_major_locator(few_ticks())
    if panel.scale == "percent":
        in_percent(axes.xaxis)


def draw_rows(
    axes: Axes,
    rows: pd.DataFrame,
    look: Mapping[str, Series],
    panel: Panel,
    names: Mapping[str, str],
    of: tuple[str, str, str] = ENDS,
) -> None:
    """Draw a panel; ``names`` are the rows in order, with what each is called."""
    intervals(axes, rows, look, order=list(names), of=of)
    name_rows(axes, list(names.values()))
    finish_panel(axes, panel)


def forest(
    rows: pd.DataFrame,
    panels: Mapping[str, Panel],
    look: Mapping[str, Series],
    *,
    title: str,
    names: Mapping[str, str] | None = None,
    of: tuple[str, str, str] = ENDS,
    columns: int = 4,
    entries_a_row: int = 4,
    behind: Callable[[Axes, str], None] | None = None,
) -> Figure:
    """Draw a panel a quantity with a row a subject, group or stratum, and one legend below.

    ``rows`` has the column ``panel`` and those of :func:`intervals`; ``names`` are the rows in order, with
    what each is called; without them all have their own. ``behind`` draws more into a panel, given its name.
    """
    names = {row: plain(name) for row, name in (names or {row: row for row in rows["row"]}).items()}
    look = {name: series for name, series in look.items() if (rows["series"] == name).any()}
    if not names or not panels:
        raise ValueError("no row to draw: the table is empty")
    across = min(columns, len(panels))
    down = -(-len(panels) // across)
    height_in = max(0.9, ROW_HEIGHT_IN * len(names)) + PANEL_FRAME_IN
    with drawing(WIDE_IN, down * height_in + 0.55, title) as figure:
        shown = panel_grid(figure, len(panels), across, sharex=False)
        for axes, (name, panel) in zip(shown, panels.items(), strict=True):
            draw_rows(axes, rows[rows["panel"] == name], look, panel, names, of)
            if behind is not None:
                behind(axes, name)
        shared_legend(figure, shown, entries_a_row)
    return figure
