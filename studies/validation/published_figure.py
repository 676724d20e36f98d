"""Published values beside simulated hearts: a panel a quantity, a bar a row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.validation.published_values import FILLING, OVER_HEARTS, QUANTITIES, RATIO, Quantity
from swesbi.report.figures.style import (
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    new_figure,
    plain_decades,
    style,
)

WIDTH_IN: Final = 1.6 * TEXT_WIDTH_IN
ROW_HEIGHT_IN: Final = 0.16
PANEL_HEIGHT_IN: Final = 0.55
"""Of a panel's title and axis."""
COLUMNS: Final = 2
GAP: Final = 0.6
"""Between hearts of different ages, in bars."""
LOGARITHMIC: Final = (RATIO, FILLING)
MEANINGS: Final = {
    "published: mean +- sd or range, as stated": OBSERVED,
    "prior: median, 5 to 95 %": PRIOR,
    "posteriors: median, 5 to 95 %, pooled": POSTERIOR,
    "virtual volunteers: range of their truths": TRUTH,
}
"""What the bars are, by their colours; said where a panel is to spare."""


@dataclass(frozen=True)
class Bar:
    """One interval of a panel.

    Attributes:
        label: What it is.
        height: Its place from the top, in bars.
        low: Lower end.
        middle: Mean or median; NaN where there is none.
        high: Upper end.
        color: Its colour.
    """

    label: str
    height: float
    low: float
    middle: float
    high: float
    color: str


def draw_published(table: pd.DataFrame) -> Figure:
    """Draw published intervals with their sources, and below them what simulated hearts of those ages have.

    Args:
        table: The rows of ``published.csv``.
    """
    panels = {
        quantity: bars_of(rows)
        for quantity in QUANTITIES
        if len(rows := table[table["quantity"] == quantity.name])
    }
    sizes = [PANEL_HEIGHT_IN + ROW_HEIGHT_IN * (bars[-1].height + 1.0) for bars in panels.values()]
    heights = [max(sizes[first : first + COLUMNS]) for first in range(0, len(sizes), COLUMNS)]
    with style():
        figure = new_figure(WIDTH_IN, sum(heights))
        grid = figure.subplots(len(heights), COLUMNS, squeeze=False, gridspec_kw={"height_ratios": heights})
        axes = list(grid.flat)
        for panel, (quantity, bars) in zip(axes, panels.items(), strict=False):
            lowest = max(one[-1].height for one in _beside(quantity, panels))
            _panel(panel, quantity, bars, lowest)
        for spare in axes[len(panels) :]:
            spare.set_axis_off()
        for line, (text, color) in enumerate(MEANINGS.items() if len(panels) < len(axes) else ()):
            axes[-1].text(0.0, 0.85 - 0.22 * line, text, color=color, transform=axes[-1].transAxes)
    return figure


def _beside(quantity: Quantity, panels: dict[Quantity, list[Bar]]) -> list[list[Bar]]:
    """Return the bars of the panels in the same row."""
    first = COLUMNS * (list(panels).index(quantity) // COLUMNS)
    return list(panels.values())[first : first + COLUMNS]


def bars_of(rows: pd.DataFrame) -> list[Bar]:
    """Return the bars of one quantity: of each range of ages the published ones, then the simulated ones."""
    bars: list[Bar] = []
    for _, of_ages in rows.groupby(["ages_from", "ages_below"], sort=False):
        start = bars[-1].height + 1.0 + GAP if bars else 0.0
        for place, (label, low, middle, high, color) in enumerate(_intervals(of_ages)):
            bars.append(Bar(label, start + place, low, middle, high, color))
    return bars


def _intervals(rows: pd.DataFrame) -> Iterator[tuple[str, float, float, float, str]]:
    for _, row in rows.iterrows():
        source = row["source"].split(",")[0]
        ends = (row["published_low"], row["published_mean"], row["published_high"])
        yield (f"{source}: {row['label']}", *ends, OBSERVED)
    first = rows.iloc[0]
    for name, label, color in (
        ("prior", "prior", PRIOR),
        ("posterior", "posteriors of volunteers", POSTERIOR),
    ):
        low, middle, high = (first[f"{name}_{level}"] for level in (5, 50, 95))
        if np.isfinite(middle):
            yield label, low, middle, high, color
    if np.isfinite(first["volunteers_low"]):
        yield "virtual volunteers", first["volunteers_low"], np.nan, first["volunteers_high"], TRUTH


def _panel(axes: Axes, quantity: Quantity, bars: list[Bar], lowest: float) -> None:
    for bar in bars:
        ends, heights = [bar.low, bar.high], [bar.height, bar.height]
        axes.plot(
            ends, heights, color=bar.color, linewidth=1.8, marker="|", markersize=4.5, markeredgewidth=0.9
        )
        middle = bar.low if bar.low == bar.high else bar.middle
        axes.plot(middle, bar.height, color=bar.color, marker="o", markersize=3.4)
    axes.set_yticks([bar.height for bar in bars], [bar.label for bar in bars])
    for tick, bar in zip(axes.get_yticklabels(), bars, strict=True):
        tick.set_color(bar.color)
    axes.set_ylim(lowest + 0.6, -0.6)
    axes.grid(axis="x", linewidth=0.3, color="#DDDDDD")
    axes.set_axisbelow(True)
    axes.tick_params(axis="y", length=0)
    unit = "" if quantity.unit == "1" else f" ({quantity.unit})"
    axes.set_title(f"{quantity.title}{unit}")
    if quantity in LOGARITHMIC:
        axes.set_xscale("log")
        plain_decades(axes.xaxis)
    elif quantity not in OVER_HEARTS:
        axes.set_xlim(left=0.0)
