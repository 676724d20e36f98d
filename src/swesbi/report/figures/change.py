"""Two visits of one person: both curves with bands, ratios as densities, and a page of the person."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from scipy.stats import gaussian_kde

from swesbi.base.arrays import FloatArray
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.change.words import (
    OF_QUANTITY,
    certificate_line,
    ratio_rows,
    shares_line,
    verdict_lines,
)
from swesbi.recording.observation import Observation
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    new_figure,
    plain,
    style,
    titled,
)
from swesbi.verdict.verdict import Verdict

COLOURS: Final = (POSTERIOR, CMAES)
"""Of the earlier visit and of the later."""
HEIGHT_IN: Final = 4.2
PAGE_IN: Final = (8.27, 11.69)  # A4
LINE: Final = 150
POINTS: Final = 200
SHOWN_MASS: Final = 0.998


@dataclass(frozen=True)
class ShownVisit:
    """One visit: its recording, its verdict, and the band of its curve under the joint posterior.

    Attributes:
        observed: The observed curve.
        verdict: The verdict.
        phase: Phases of the band; shape (k,).
        low: Lower end in kPa; shape (k,).
        median: Median; shape (k,).
        high: Upper end; shape (k,).
    """

    observed: Observation
    verdict: Verdict
    phase: FloatArray
    low: FloatArray
    median: FloatArray
    high: FloatArray


def draw_change(change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str) -> Figure:
    """Draw both curves with bands, and the posterior of each ratio.

    Args:
        change: What has changed.
        visits: The earlier visit and the later.
        cohort_title: What figures call the subjects.
    """
    change = _in_plain_names(change)
    with style():
        figure = new_figure(1.4 * TEXT_WIDTH_IN, HEIGHT_IN)
        figure.suptitle(titled(f"{change.person}, {change.visit[0]} to {change.visit[1]}", cohort_title))
        parts = _parts(figure, (1.3, 1.0))
        draw_curves(parts[0].subplots(), change, visits)
        draw_ratios(parts[1].subplots(1, len(change.quantity)), change)
    return figure


def _in_plain_names(change: StoredChange) -> StoredChange:
    first, second = change.visit
    return replace(change, person=plain(change.person), visit=(plain(first), plain(second)))


def _parts(figure: Figure, heights: Sequence[float]) -> list[SubFigure]:
    """Return parts of a figure of these heights, one below the other."""
    return list(np.ravel(np.asarray(figure.subfigures(len(heights), 1, height_ratios=list(heights)))))


def draw_curves(axes: Axes, change: StoredChange, visits: Sequence[ShownVisit]) -> None:
    """Draw the measured phases and the band of each visit."""
    bar: dict[str, Any] = {"fmt": "o", "ms": 2.4, "elinewidth": 0.7, "capsize": 1.3}
    for name, visit, colour in zip(change.visit, visits, COLOURS, strict=True):
        observed, mass = visit.observed, f"{change.interval_mass:.0%}"
        axes.fill_between(visit.phase, visit.low, visit.high, color=colour, alpha=0.22, lw=0)
        axes.plot(visit.phase, visit.median, color=colour, lw=1.0, label=f"{name}: median and {mass} band")
        kept = observed.measured
        axes.errorbar(
            observed.phase[kept],
            observed.stiffness_kpa[kept],
            observed.stiffness_se_kpa[kept],
            color=colour,
            label=f"{name}: measured ± SE",
            **bar,
        )
    axes.set(
        xlabel="phase of the cardiac cycle, from the R peak", ylabel="stiffness $E = 3\\rho c_s^2$ (kPa)"
    )
    axes.set_xlim(0.0, 1.0)
    axes.legend(ncols=2)


def draw_ratios(axes: Sequence[Axes], change: StoredChange) -> None:
    """Draw the posterior of each log ratio with median, interval and the band of no change."""
    with np.errstate(invalid="ignore"):
        log_ratio = np.log(change.quantities[1] / change.quantities[0])
    known = log_ratio[np.isfinite(log_ratio).all(axis=1)]
    beyond = np.log1p(change.threshold)
    for j, (panel, name) in enumerate(zip(axes, change.quantity, strict=True)):
        draws, ratios = known[:, j], change.ratios
        tail = 0.5 * (1.0 - SHOWN_MASS)
        low, high = np.quantile(draws, [tail, 1.0 - tail])
        grid = np.linspace(min(low, -1.5 * beyond), max(high, 1.5 * beyond), POINTS)
        density = gaussian_kde(draws)(grid)
        panel.axvspan(np.exp(-beyond), np.exp(beyond), color=EXCLUDED_BACKGROUND, zorder=0)
        panel.axvline(1.0, color=PRIOR, lw=0.6)
        panel.fill_between(np.exp(grid), density, color=POSTERIOR, alpha=0.3, lw=0)
        panel.plot([ratios.low[j], ratios.high[j]], [0.0, 0.0], color=POSTERIOR, lw=2.5, clip_on=False)
        panel.plot([ratios.median[j]], [0.0], "o", color=POSTERIOR, ms=4.0, clip_on=False)
        panel.set(title="\n".join(textwrap.wrap(OF_QUANTITY[name], 22)), xlabel="later / earlier", yticks=[])
        panel.set_ylim(bottom=0.0)
        panel.spines["left"].set_visible(False)


def draw_change_sheet(change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str) -> Figure:
    """Draw one page of the person: verdicts, both recordings, ratios in a table, what all is conditional on.

    Arguments as of :func:`draw_change`.
    """
    change = _in_plain_names(change)
    with style():
        figure = new_figure(*PAGE_IN)
        figure.suptitle(
            titled(f"{change.person}: {change.visit[0]} to {change.visit[1]}", cohort_title), fontsize=11.0
        )
        parts = _parts(figure, (1.3, 3.2, 2.0, 1.7, 1.8))
        _write(parts[0].subplots(), _recordings(change, visits) + verdict_lines(change))
        draw_curves(parts[1].subplots(), change, visits)
        draw_ratios(parts[2].subplots(1, len(change.quantity)), change)
        _draw_table(parts[3].subplots(), change)
        _write(parts[4].subplots(), _conditions(change))
    return figure


def _recordings(change: StoredChange, visits: Sequence[ShownVisit]) -> list[str]:
    """Return a line on the quality of each recording."""
    lines = []
    for name, visit in zip(change.visit, visits, strict=True):
        observed, context = visit.observed, visit.observed.context
        accepted, rejected = observed.samples_accepted.sum(), observed.samples_rejected.sum()
        reasons = f"; {'; '.join(visit.verdict.reasons)}" if visit.verdict.reasons else ""
        lines.append(
            f"{name}: {context.hr_bpm:g} bpm, {observed.measured.sum()} of {len(observed.phase)} phases "
            f"measured, {accepted} samples accepted, {rejected} rejected{reasons}"
        )
    return lines


def _conditions(change: StoredChange) -> list[str]:
    return [
        certificate_line(change),
        shares_line(change),
        "Ratios hold if the heart is one that the model can be: parameters of another structure change by "
        f"other factors. P(> {change.threshold:.0%}) is the posterior probability of a change beyond that, "
        "up or down, of which one direction alone must be likely; detectable is the smallest change that "
        "recordings like these call one with the power "
        "that is configured; narrower by compares the interval with that of two independent posteriors.",
    ]


def _write(axes: Axes, lines: Sequence[str]) -> None:
    """Write lines from the top, broken to the width of the page."""
    axes.set_axis_off()
    broken = [part for line in lines for part in textwrap.wrap(line, LINE, subsequent_indent="    ")]
    axes.text(0.0, 1.0, "\n".join(broken), va="top", fontsize=7.5, transform=axes.transAxes)


def _draw_table(axes: Axes, change: StoredChange) -> None:
    axes.set_axis_off()
    head, *rows = ratio_rows(change)
    table = axes.table(
        cellText=rows, colLabels=list(head), loc="center", cellLoc="center", edges="horizontal",
        colWidths=[0.28, 0.09, 0.17, 0.1, 0.11, 0.12, 0.13],
    )  # fmt: skip
    table.auto_set_font_size(False)
    table.set_fontsize(7.5)
    table.scale(1.0, 1.25)
