"""Two visits of one person: both curves with bands, ratios as intervals, and a page of the person."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import Band
from swesbi.persons.change.ratios import WORDS
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.change.words import certificate_line, ratio_rows, shares_line, verdict_lines
from swesbi.recording.observation import Observation
from swesbi.report.figures.band import STIFFNESS, cycle_axis, draw_band, draw_points
from swesbi.report.figures.forest import ENDS, Panel, Series, finish_panel, intervals, name_rows
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    POSTERIOR,
    TEXT_WIDTH_IN,
    new_figure,
    plain,
    style,
    titled,
)
from swesbi.verdict.verdict import Verdict

COLOURS: Final = (POSTERIOR, CMAES)
"""Of the earlier visit and of the later."""
WIDTH_IN, HEIGHT_IN = 1.4 * TEXT_WIDTH_IN, 4.4
PAGE_IN: Final = (8.27, 11.69)  # A4
LINE: Final = 150
HOLDS: Final = (
    "Ratios hold if the heart is one that the model can be: parameters of another structure change by other "
    "factors. P(> {threshold:.0%}) is the posterior probability of a change beyond that, up or down, of "
    "which one direction alone must be likely; detectable is the smallest change that recordings like these "
    "call one with the power that is configured; narrower by compares the interval with that of two "
    "independent posteriors."
)


@dataclass(frozen=True)
class ShownVisit:
    """One visit: its recording, its verdict, and the band of its curve under the joint posterior.

    Attributes:
        observed: The observed curve.
        verdict: The verdict.
        phase: Phases of the band; shape (k,).
        band: In kPa.
    """

    observed: Observation
    verdict: Verdict
    phase: FloatArray
    band: Band


def draw_change(change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str) -> Figure:
    """Draw both curves with bands, and the posterior of each ratio.

    Args:
        change: What has changed.
        visits: The earlier visit and the later.
        cohort_title: What figures call the subjects.
    """
    return _drawn(change, visits, cohort_title, (WIDTH_IN, HEIGHT_IN), (), ())


def draw_change_sheet(change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str) -> Figure:
    """Draw one page of the person: verdicts, both recordings, ratios in a table, what all is conditional on.

    Arguments as of :func:`draw_change`.
    """
    below = [certificate_line(change), shares_line(change), HOLDS.format(threshold=change.threshold)]
    return _drawn(change, visits, cohort_title, PAGE_IN, (1.3,), (1.7, 1.8), below)


def _drawn(
    change: StoredChange,
    visits: Sequence[ShownVisit],
    cohort_title: str,
    size_in: tuple[float, float],
    above: tuple[float, ...],
    further: tuple[float, ...],
    below: Sequence[str] = (),
) -> Figure:
    """Draw curves and ratios; texts ``above`` and a table and texts ``below``, of these relative heights."""
    change = replace(change, person=plain(change.person), visit=tuple(map(plain, change.visit)))
    with style():
        figure = new_figure(*size_in)
        figure.suptitle(titled(f"{change.person}, {' to '.join(change.visit)}", cohort_title))
        heights = [*above, 3.0, 1.6, *further]
        parts = list(np.ravel(np.asarray(figure.subfigures(len(heights), 1, height_ratios=heights))))
        if above:
            _write(parts.pop(0).subplots(), _recordings(change, visits) + verdict_lines(change))
        draw_curves(parts[0].subplots(), change, visits)
        parts[0].legend(loc="outside lower center", ncols=2)
        draw_ratios(parts[1].subplots(), change)
        if further:
            _draw_table(parts[2].subplots(), change)
            _write(parts[3].subplots(), below)
    return figure


def draw_curves(axes: Axes, change: StoredChange, visits: Sequence[ShownVisit]) -> None:
    """Draw the measured phases and the band of each visit."""
    for name, visit, colour in zip(change.visit, visits, COLOURS, strict=True):
        observed = visit.observed
        of_band = f"{name}: median and {change.interval_mass:.0%} interval"
        draw_band(axes, visit.phase, visit.band, colour, of_band)
        value = np.where(observed.measured, observed.stiffness_kpa, np.nan)
        of_points = f"{name}: measured ± SE"
        draw_points(axes, observed.phase, value, observed.stiffness_se_kpa, of_points, color=colour)
    axes.set_ylabel(STIFFNESS)
    cycle_axis(axes)


def draw_ratios(axes: Axes, change: StoredChange) -> None:
    """Draw median and interval of each ratio over what counts as no change."""
    ends = zip(change.ratios.low, change.ratios.median, change.ratios.high, strict=True)
    rows = pd.DataFrame(
        [(j, "ratio", *each) for j, each in enumerate(ends)], columns=["row", "series", *ENDS]
    )
    axes.axvspan(1.0 / (1.0 + change.threshold), 1.0 + change.threshold, color=EXCLUDED_BACKGROUND, zorder=0)
    intervals(axes, rows, {"ratio": Series(POSTERIOR, "")})
    label = (
        f"later / earlier, {change.interval_mass:.0%} intervals; grey: less than {change.threshold:.0%} apart"
    )
    finish_panel(axes, Panel("", label, "log", mark=1.0))
    name_rows(axes, WORDS)


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
