"""Two visits of one person: both curves with bands, ratios as intervals, and a page of the person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import Band
from swesbi.persons.change.stored import (
    WORDS,
    StoredChange,
    certificate_line,
    ratio_rows,
    shares_line,
    verdict_lines,
)
from swesbi.recording.observation import Observation
from swesbi.report.figures.band import STIFFNESS, cycle_axis, draw_band, draw_points
from swesbi.report.figures.forest import ENDS, Panel, Series, finish_panel, intervals, name_rows
from swesbi.report.figures.sheet import PAGE_IN, write_lines, write_table
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    POSTERIOR,
    TEXT_WIDTH_IN,
    drawing,
    plain,
    titled,
)
from swesbi.verdict.verdict import Verdict

COLOURS: Final = (POSTERIOR, CMAES)
"""Of the earlier visit and of the later."""
WIDTH_IN, HEIGHT_IN = 1.4 * TEXT_WIDTH_IN, 4.4
HEIGHTS: Final = (3.0, 1.6)
LINE: Final = 150
INDENTS: Final = ("", "    ")
WIDTHS: Final = (0.28, 0.09, 0.17, 0.1, 0.11, 0.12, 0.13)
HOLDS: Final = (
    "Ratios hold if the heart is one that the model can be: parameters of another structure change by other "
    "factors. P(> {threshold:.0%}) is the posterior probability of a change beyond that, up or down, of "
    "which one direction alone must be likely; detectable is the smallest change that recordings like these "
    "call one with the power that is configured; narrower by compares the interval with that of two "
    "independent posteriors."
)


@dataclass(frozen=True)
class ShownVisit:
    """One visit: recording, verdict, and the band (kPa) of its curve at ``phase``, of the joint posterior."""

    observed: Observation
    verdict: Verdict
    phase: FloatArray
    band: Band


def draw_change(change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str) -> Figure:
    """Draw both curves with bands, and the posterior of each ratio."""
    return _drawn(change, visits, cohort_title, (WIDTH_IN, HEIGHT_IN), HEIGHTS)


def draw_change_sheet(change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str) -> Figure:
    """Draw one page of the person: verdicts, recordings, ratios in a table, what all is conditional on."""
    return _drawn(change, visits, cohort_title, PAGE_IN, (1.3, *HEIGHTS, 1.7, 1.8))


def _drawn(
    change: StoredChange,
    visits: Sequence[ShownVisit],
    cohort_title: str,
    size_in: tuple[float, float],
    heights: Sequence[float],
) -> Figure:
    """Draw curves and ratios, in parts of these relative heights; on a page with texts and a table."""
    change = replace(change, person=plain(change.person), visit=tuple(map(plain, change.visit)))
    title = titled(f"{change.person}, {' to '.join(change.visit)}", cohort_title)
    with drawing(*size_in, title, "large") as figure:
        parts = list(np.ravel(np.asarray(figure.subfigures(len(heights), 1, height_ratios=heights))))
        curves, ratios = parts if len(parts) == len(HEIGHTS) else parts[1:3]
        draw_curves(curves.subplots(), change, visits)
        curves.legend(loc="outside lower center", ncols=2)
        draw_ratios(ratios.subplots(), change)
        if len(parts) > len(HEIGHTS):
            _write_page(change, visits, *(parts[part].subplots() for part in (0, 3, 4)))
    return figure


def _write_page(
    change: StoredChange, visits: Sequence[ShownVisit], above: Axes, table: Axes, below: Axes
) -> None:
    head, *rows = ratio_rows(change)
    conditions = [certificate_line(change), shares_line(change), HOLDS.format(threshold=change.threshold)]
    lines = [*_recordings(change, visits), *verdict_lines(change)]
    write_lines(above, lines, LINE, INDENTS, fontsize=7.5)
    write_table(table, head, rows, WIDTHS, 1.25)
    write_lines(below, conditions, LINE, INDENTS, fontsize=7.5)


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
    ends = pd.DataFrame({end: getattr(change.ratios, end) for end in ENDS})
    axes.axvspan(1.0 / (1.0 + change.threshold), 1.0 + change.threshold, color=EXCLUDED_BACKGROUND, zorder=0)
    intervals(axes, ends.assign(row=ends.index, series="ratio"), {"ratio": Series(POSTERIOR, "")})
    label = (
        f"later / earlier, {change.interval_mass:.0%} intervals; grey: less than {change.threshold:.0%} apart"
    )
    finish_panel(axes, Panel("", label, "log", mark=1.0))
    name_rows(axes, WORDS)


def _recordings(change: StoredChange, visits: Sequence[ShownVisit]) -> Iterator[str]:
    """Yield a line on the quality of each recording."""
    for name, visit in zip(change.visit, visits, strict=True):
        observed, context = visit.observed, visit.observed.context
        accepted, rejected = observed.samples_accepted.sum(), observed.samples_rejected.sum()
        reasons = f"; {'; '.join(visit.verdict.reasons)}" if visit.verdict.reasons else ""
        yield (
            f"{name}: {context.hr_bpm:g} bpm, {observed.measured.sum()} of {len(observed.phase)} phases "
            f"measured, {accepted} samples accepted, {rejected} rejected{reasons}"
        )
