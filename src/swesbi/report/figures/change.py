"""Changes of persons: both visits of one with their ratios, and the power of a planned study to find any."""

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
    ratio_rows,
    sampling_line,
    shares_line,
    verdict_lines,
)
from swesbi.persons.planning.power import NINETY, Plan
from swesbi.recording.observation import Observation
from swesbi.report.figures.forest import ENDS, Panel, Series, draw_rows
from swesbi.report.figures.sheet import PAGE_IN, write_lines, write_table
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    EXCLUDED_BACKGROUND,
    NETWORK,
    POSTERIOR,
    PRIOR,
    STIFFNESS,
    TEXT_WIDTH_IN,
    TRUTH,
    cycle_axis,
    draw_band,
    draw_points,
    drawing,
    in_percent,
    plain,
    shared_legend,
    titled,
)
from swesbi.verdict.verdict import Verdict

COLOURS: Final = (POSTERIOR, CMAES, TRUTH, NETWORK, DOUBTFUL)
"""Of the earlier visit and of the later, or of numbers of repeats."""
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


def draw_change(
    change: StoredChange, visits: Sequence[ShownVisit], cohort_title: str, *, page: bool = False
) -> Figure:
    """Draw both curves with bands, and the posterior of each ratio.

    A page of the person also has verdicts, recordings, ratios in a table, and what all is conditional on.
    """
    heights = (1.3, *HEIGHTS, 1.7, 1.8) if page else HEIGHTS
    size_in = PAGE_IN if page else (WIDTH_IN, HEIGHT_IN)
    change = replace(change, person=plain(change.person), visit=tuple(map(plain, change.visit)))
    title = titled(f"{change.person}, {' to '.join(change.visit)}", cohort_title)
    with drawing(*size_in, title, "large") as figure:
        parts = list(np.ravel(np.asarray(figure.subfigures(len(heights), 1, height_ratios=heights))))
        curves, ratios = parts[1:3] if page else parts
        draw_curves(curves.subplots(), change, visits)
        curves.legend(loc="outside lower center", ncols=2)
        draw_ratios(ratios.subplots(), change)
        if page:
            _write_page(change, visits, *(parts[part].subplots() for part in (0, 3, 4)))
    return figure


def _write_page(
    change: StoredChange, visits: Sequence[ShownVisit], above: Axes, table: Axes, below: Axes
) -> None:
    head, *rows = ratio_rows(change)
    conditions = [sampling_line(change), shares_line(change), HOLDS.format(threshold=change.threshold)]
    lines = [*_recordings(change, visits), *verdict_lines(change)]
    write_lines(above, lines, LINE, INDENTS, fontsize=7.5)
    write_table(table, head, rows, WIDTHS, 1.25)
    write_lines(below, conditions, LINE, INDENTS, fontsize=7.5)


def draw_curves(axes: Axes, change: StoredChange, visits: Sequence[ShownVisit]) -> None:
    """Draw the measured phases and the band of each visit."""
    for name, visit, colour in zip(change.visit, visits, COLOURS[:2], strict=True):
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
    label = (
        f"later / earlier, {change.interval_mass:.0%} intervals; grey: less than {change.threshold:.0%} apart"
    )
    rows, names = ends.assign(row=WORDS, series="ratio"), {word: word for word in WORDS}
    draw_rows(axes, rows, {"ratio": Series(POSTERIOR, "")}, Panel("", label, "log", mark=1.0), names)


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


def draw_plan(planned: Plan) -> Figure:
    """Draw power with its Monte Carlo band, what is found without an effect, and the persons needed."""
    with drawing(TEXT_WIDTH_IN, 3.4) as figure:
        axes = figure.subplots()
        for number, curve in enumerate(planned.curves):
            color, name, needed = COLOURS[number % len(COLOURS)], f"{curve.repeats} repeats", curve.needed[0]
            ends = (np.clip(curve.power + side * NINETY * curve.power_se, 0.0, 1.0) for side in (-1.0, 1.0))
            reached = f"{needed} needed" if needed is not None else "not reached"
            sizes, label = curve.sizes.astype(float), f"{name}, 90 % band: {reached}"
            draw_band(axes, sizes, Band(curve.power, *ends), color, label)
            axes.plot(sizes, curve.power, "o", color=color, ms=2.5)
            axes.plot(sizes, curve.false_positive, ":", color=color, label=f"{name}, no effect")
            if needed is not None:
                axes.axvline(needed, color=color, lw=0.6)
        axes.axhline(planned.power, color=PRIOR, lw=0.7, ls="--", label="power asked for")
        level = 1.0 - planned.settings.probability
        axes.axhline(level, color=PRIOR, lw=0.5, ls=":", label="false alarms of the rule")
        axes.set(
            xlabel=planned.unit,
            ylabel="share of studies that find it",
            ylim=(0.0, 1.02),
            title=f"{planned.effect.words}, {planned.design}, errors of a repeat {planned.noise:.1%}",
        )
        in_percent(axes.yaxis)
        shared_legend(figure, [axes], 2)
    return figure
