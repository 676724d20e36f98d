"""Placing one panel a subject, whatever their number."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from swesbi.figures.style import EXCLUDED_BACKGROUND


def columns(panels: int) -> int:
    """Return how many columns a grid of panels gets: few and wide for small cohorts, at most five."""
    if panels <= 3:
        return panels
    if panels == 4:
        return 2
    return 3 if panels <= 9 else 4 if panels <= 24 else 5


def rows(panels: int) -> int:
    """Return how many rows the grid needs."""
    return math.ceil(panels / columns(panels))


def panel_grid(figure: Figure | SubFigure, panels: int) -> list[Axes]:
    """Return one axes a panel, row by row, with common scales; what is left of the last row stays empty."""
    grid = figure.subplots(rows(panels), columns(panels), sharex=True, sharey=True, squeeze=False)
    axes = list(grid.flat)
    for spare in axes[panels:]:
        spare.remove()
    for lowest in axes[max(0, panels - columns(panels)) : panels]:
        lowest.tick_params(labelbottom=True)
    return axes[:panels]


def label_outer(axes: Sequence[Axes], xlabel: str) -> None:
    """Label the x axis of the lowest panel of each column."""
    for lowest in axes[max(0, len(axes) - columns(len(axes))) :]:
        lowest.set_xlabel(xlabel)


def mark_excluded(axes: Axes) -> None:
    """Grey the panel of a subject outside the prior's support."""
    axes.set_facecolor(EXCLUDED_BACKGROUND)


def shared_legend(figure: Figure, axes: Sequence[Axes], entries_a_row: int) -> None:
    """Put one legend below all panels, each label once."""
    handles: dict[str, Artist] = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower center",
        ncols=entries_a_row,
        columnspacing=1.2,
        handlelength=1.8,
    )
