"""One page of a subject: verdict, recording and its prediction, posterior, numbers and their conditions."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill, wrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.table import Table

from swesbi.parameters import REPORTED, REPORTED_NAMES
from swesbi.report.figures.posterior import log_density_of_draws
from swesbi.report.figures.predictive import draw_curve
from swesbi.report.figures.style import (
    ACCEPTED_COLOR,
    EXCLUDED_BACKGROUND,
    PRIOR,
    REFUSED_COLOR,
    STATUS_COLORS,
    drawing,
    plain,
    plain_decades,
)
from swesbi.report.sheet import (
    RecordingSummary,
    Sheet,
    header,
    heart_line,
    in_words,
    notes,
    rows,
    verdict_text,
)

PAGE_IN: Final = (8.27, 11.69)  # A4
MARGIN_IN: Final = 0.55
TEXT_IN: Final = PAGE_IN[0] - 2.0 * MARGIN_IN
PANEL_GAP_IN: Final = 0.08
DRAWN: Final = ("duration_ms", "peak_kpa", "decay_rate_per_s", "k_sr_per_s", "peak_active_kpa", "k0_kpa")
"""Quantities whose densities are drawn; the table has all."""
LINE: Final = 140
LABEL: Final = 44
BULLET: Final = "–  "
VERDICT_LINE: Final = 96
VERDICT_LINES: Final = 5


def draw_sheet(sheet: Sheet) -> Figure:
    """Draw the page of one subject, all parts at fixed places, so that no layout is worked out."""
    with drawing(*PAGE_IN, fixed=True) as figure:
        left = _draw_head(_placed(figure, 0.58, 1.14), sheet)
        curves = _placed(figure, 2.13, 1.42, left_in=0.99, width_in=4.28)
        draw_curve(curves, sheet.curve, STATUS_COLORS[sheet.verdict.status])
        curves.set_title("The recording, and what is predicted of it")
        middle = (0.5, 1.0 - 4.13 / PAGE_IN[1])
        figure.legend(loc="center", bbox_to_anchor=middle, ncols=2, columnspacing=1.2, handlelength=1.6)
        _draw_counts(_placed(figure, 2.13, 1.42, left_in=6.30, width_in=1.40), sheet.recorded)
        step_in = (TEXT_IN + PANEL_GAP_IN) / len(DRAWN)
        places = [MARGIN_IN + step_in * number for number in range(len(DRAWN))]
        panels = [
            _placed(figure, 4.58, 0.85, left_in=place, width_in=step_in - PANEL_GAP_IN) for place in places
        ]
        _draw_densities(panels, sheet)
        _draw_table(_placed(figure, 5.94, 2.50), sheet)
        write_lines(
            _placed(figure, 8.49, 2.60), [*left, *notes(sheet)], LINE, (BULLET, " " * len(BULLET)),
            fontsize=7.0, linespacing=1.35,
        )  # fmt: skip
    return figure


def _placed(
    figure: Figure, top_in: float, height_in: float, left_in: float = MARGIN_IN, width_in: float = TEXT_IN
) -> Axes:
    """Return axes at a place of the page, counted from its upper left corner; by default as wide as text."""
    width, height = PAGE_IN
    box = (left_in / width, 1.0 - (top_in + height_in) / height, width_in / width, height_in / height)
    return figure.add_axes(box)


def _draw_head(axes: Axes, sheet: Sheet) -> list[str]:
    """Write who it is, and the verdict in a box of its colour; return what there is no room for."""
    axes.set_axis_off()
    place: dict[str, Any] = {"transform": axes.transAxes, "va": "top"}
    axes.text(0.0, 1.0, sheet.context.subject, fontsize=15.0, weight="bold", **place)
    axes.text(1.0, 0.98, plain(sheet.cohort_title), fontsize=8.0, color=PRIOR, ha="right", **place)
    axes.text(0.0, 0.74, heart_line(sheet.context), fontsize=8.0, **place)
    word, said = verdict_text(sheet.verdict)
    box = {"boxstyle": "round,pad=0.45", "facecolor": STATUS_COLORS[word], "edgecolor": "none"}
    axes.text(0.008, 0.52, word.upper(), fontsize=9.0, weight="bold", color="white", bbox=box, **place)
    broken = [wrap(line, VERDICT_LINE) for line in said]
    fitting = int(np.sum(np.cumsum([len(lines) for lines in broken]) <= VERDICT_LINES))
    lines = [part for each in broken[:fitting] for part in each]
    axes.text(0.245, 0.55, "\n".join(lines), fontsize=7.5, linespacing=1.3, **place)
    return list(said[fitting:])


def _draw_counts(axes: Axes, recorded: RecordingSummary) -> None:
    """Draw how many were accepted, and how many rejected for which reason."""
    counts = {"accepted": recorded.accepted}
    counts |= {in_words(reason): n for reason, n in recorded.rejected.items()}
    place = np.arange(len(counts))
    bars = axes.barh(
        place, list(counts.values()), 0.6, color=[ACCEPTED_COLOR, *[REFUSED_COLOR] * len(recorded.rejected)]
    )
    axes.bar_label(bars, padding=2.0, fontsize=6.5)
    axes.set_yticks(place, list(counts))
    axes.set(
        title=f"Quality: {recorded.unit}",
        xticks=[],
        xlim=(None, 1.25 * max(counts.values())),
        ylim=(max(len(counts), 4) - 0.4, -0.6),
    )
    axes.spines["bottom"].set_visible(False)


def _draw_densities(axes: Sequence[Axes], sheet: Sheet) -> None:
    """Draw prior and posterior of each quantity, with median and interval."""
    low, median, high = sheet.limits
    colour = STATUS_COLORS[sheet.verdict.status]
    for panel, name in zip(axes, DRAWN, strict=True):
        j = REPORTED_NAMES.index(name)
        for draws, color in ((sheet.population.prior[:, j], PRIOR), (sheet.values[:, j], colour)):
            first, last = np.percentile(draws, (0.5, 99.5))
            density = log_density_of_draws(draws[(draws >= first) & (draws <= last)])
            panel.fill_between(*density, color=color, alpha=0.35, lw=0)
        panel.plot([low[j], high[j]], [0.0, 0.0], color=colour, lw=3.0, clip_on=False)
        panel.plot([median[j]], [0.0], "o", color=colour, ms=4.5, clip_on=False)
        plain_decades(panel.xaxis)
        panel.set(title=f"{REPORTED[j].tex} ({REPORTED[j].unit})", yticks=[], ylim=(0.0, None))
        panel.spines["left"].set_visible(False)


def _draw_table(axes: Axes, sheet: Sheet) -> None:
    names = header(sheet)
    further = len(names) - 5
    widths = [0.33, 0.07, 0.13, 0.17, 0.13, *[0.057] * further]
    if further:
        axes.set_title(f"width with more {sheet.recorded.more}", loc="right", fontsize=7.0)
    table = write_table(axes, names, rows(sheet), widths, 1.1, loc="upper center")
    for (row, column), cell in table.get_celld().items():
        cell.set_edgecolor(EXCLUDED_BACKGROUND)
        if column == 0:
            cell.PAD = 0.01
            cell.set_text_props(ha="left")
            label = cell.get_text().get_text()
            if len(label.partition("$")[0]) > LABEL:
                cell.set_text_props(text=fill(label, LABEL), fontsize=5.8)
        if row == 0 or column == 1:
            cell.set_text_props(weight="bold")


def write_table(
    axes: Axes,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    widths: Sequence[float],
    stretch: float,
    loc: str = "center",
) -> Table:
    """Write a table on a page in place of axes; rows are stretched in height."""
    axes.set_axis_off()
    table = axes.table(
        cellText=rows, colLabels=head, loc=loc, cellLoc="center", edges="horizontal", colWidths=widths
    )
    table.auto_set_font_size(False)
    table.set_fontsize(7.5)
    table.scale(1.0, stretch)
    return table


def write_lines(
    axes: Axes,
    lines: Sequence[str],
    width: int,
    indents: tuple[str, str],
    **look: Any,  # noqa: ANN401
) -> None:
    """Write lines in place of axes, broken at a width, with indents of a line's first part and the others."""
    axes.set_axis_off()
    first, further = indents
    broken = [
        part for line in lines for part in wrap(line, width, initial_indent=first, subsequent_indent=further)
    ]
    axes.text(0.0, 1.0, "\n".join(broken), va="top", transform=axes.transAxes, **look)
