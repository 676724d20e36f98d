"""The posterior of a population: each member alone and within it, over its band, and the groups.

Members are subjects with theta, or persons with the ratio of theta at two visits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import ndtri

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.draws import interval_levels, median_and_interval
from swesbi.parameters import THETA
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.recording.cohort.visits import EVERYONE
from swesbi.report.figures.forest import ENDS, Panel, Series, finish_panel, intervals, name_rows
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    NETWORK,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TRUTH,
    Drawing,
    new_figure,
    plain,
    shared_legend,
    style,
    titled,
)
from swesbi.verdict.verdict import Status

WIDTH_IN: Final = 7.2
ROW_HEIGHT_IN: Final = 0.19
FRAME_HEIGHT_IN: Final = 0.65
MOST_DRAWN: Final = 40
"""Members of the figure, the first ones; the table has all."""
GROUP_COLORS: Final = (POSTERIOR, CMAES, NETWORK, DOUBTFUL, OBSERVED)
LIGHT: Final = 0.16
ALONE, TRUE = "alone", "truth"
DOUBTED: Final = "open: doubted or contradicted"


def draw_cohort_posterior(cohort_posterior: CohortPosterior, *, cohort_title: str) -> Drawing:
    """Draw a column a parameter: every subject alone and within the population, and the groups below.

    Args:
        cohort_posterior: The posterior of the cohort.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    panels = [Panel(parameter.meaning, parameter.label, "log") for parameter in THETA]
    return _drawn(cohort_posterior, panels, titled("The cohort as a posterior", cohort_title), "median", None)


def draw_change_groups(
    stored: CohortPosterior, *, cohort_title: str, truth: FloatArray | None = None
) -> Figure:
    """Draw a column a parameter: every person's ratio alone and within the group, and the groups below.

    Args:
        stored: What has changed.
        cohort_title: What the persons are ("virtual trial").
        truth: True ratios of the persons of a generated cohort; shape (d, 3).
    """
    head = titled("What has changed, later over earlier", cohort_title)
    panels = [Panel(each.meaning, f"{each.tex}, later over earlier", "log", mark=1.0) for each in THETA]
    return _drawn(stored, panels, head, "mean ratio", truth)


def _drawn(
    stored: CohortPosterior, panels: Sequence[Panel], title: str, middle: str, truth: FloatArray | None
) -> Figure:
    """Draw members, then what ``middle`` names of each group, then ratios of groups if these are compared."""
    order = np.argsort(_numbers(stored), kind="stable")[:MOST_DRAWN]
    names = [[stored.member[d] for d in order], [f"{middle}, {name}" for name in _groups(stored)]]
    names += [[f"{name} over {stored.reference_group}" for name in stored.compared_group]]
    names = [part for part in names if part]
    heights = [ROW_HEIGHT_IN * len(part) + FRAME_HEIGHT_IN for part in names]
    if stored.groups:
        title = f"{title}; groups are compared with {plain(stored.reference_group)}"
    with style():
        figure = new_figure(WIDTH_IN, sum(heights) + FRAME_HEIGHT_IN)
        grid = figure.subplots(len(names), len(panels), height_ratios=heights, squeeze=False)
        for j, (column, panel) in enumerate(zip(grid.T, panels, strict=True)):
            _bands(column[0], stored, order, j)
            intervals(column[0], _member_rows(stored, order, truth, j), _look(stored))
            finish_panel(column[0], panel)
            for axes, part, ratio in zip(column[1:], names[1:], (False, True), strict=False):
                rows = _group_rows(stored, truth, j, ratio=ratio)
                intervals(axes, rows, _look(stored))
                mark = 1.0 if ratio else panel.mark
                finish_panel(axes, Panel("", "ratio of groups" if ratio else panel.label, "log", mark))
                axes.set_ylim(len(part) - 0.5, -0.5)
            for axes in column:
                axes.set_yticks([])
            column[0].set_ylim(len(order) - 0.5, -0.5)
        for axes, part in zip(grid[:, 0], names, strict=True):
            name_rows(axes, part)
        figure.suptitle(title, fontsize=7.5)
        shared_legend(figure, list(grid.ravel()), 3)
    return figure


def _groups(stored: CohortPosterior) -> tuple[str, ...]:
    return stored.groups or (EVERYONE,)


def _numbers(stored: CohortPosterior) -> IntArray:
    """Return the place of each member's group among those that are compared, 0 where none are; shape (d,)."""
    return np.array([stored.groups.index(group) if stored.groups else 0 for group in stored.group])


def _look(stored: CohortPosterior) -> Mapping[str, Series]:
    """Return how series look: names of groups, with a star where a recording is doubted."""
    look = {ALONE: Series(PRIOR, "each alone", lane=ALONE)}
    for number, name in enumerate(_groups(stored)):
        color = GROUP_COLORS[number % len(GROUP_COLORS)]
        of = f", {name}" if stored.groups else ""
        look[name] = Series(color, f"within the population{of}", lane="within")
        look[f"{name}*"] = Series(color, DOUBTED, filled=False, lane="within")
    return look | {TRUE: Series(TRUTH, "truth", marker="x", filled=False, lane="within", size=4.0)}


def _member_rows(stored: CohortPosterior, order: IntArray, truth: FloatArray | None, j: int) -> pd.DataFrame:
    """Return the intervals of members: alone, within, and their truth; ``row`` is the place."""
    doubted = np.isin(stored.verdict, [Status.DOUBTFUL, Status.CONTRADICTED])
    names, numbers, rows = _groups(stored), _numbers(stored), []
    for place, d in enumerate(order):
        series = f"{names[numbers[d]]}{'*' if doubted[d] else ''}"
        rows.append((place - 0.17, ALONE, *stored.members.before[d, :, j]))
        rows.append((place + 0.17, series, *stored.members.after[d, :, j]))
        if truth is not None:
            rows.append((place + 0.17, TRUE, *[truth[d, j]] * 3))
    return pd.DataFrame(rows, columns=["row", "series", *ENDS])


def _group_rows(stored: CohortPosterior, truth: FloatArray | None, j: int, *, ratio: bool) -> pd.DataFrame:
    """Return the intervals of the medians of groups, or of their ratios to the reference, and the truth."""
    numbers, rows = _numbers(stored), []
    for number, name in enumerate(_groups(stored)):
        draws = stored.median_of(number)[:, j]
        true = np.nan if truth is None else float(np.log(truth[numbers == number, j]).mean())
        if ratio:
            draws = draws / stored.median_of(0)[:, j]
            true -= np.nan if truth is None else float(np.log(truth[numbers == 0, j]).mean())
        if not ratio or number:
            place = number - int(ratio)
            rows.append((place, name, *median_and_interval(draws, stored.interval_mass)))
            rows.append((place, TRUE, *[np.exp(true)] * 3))
    return pd.DataFrame(rows, columns=["row", "series", *ENDS])


def _bands(axes: Axes, stored: CohortPosterior, order: IntArray, j: int) -> None:
    """Shade where the interval's mass of the persons of each group lies."""
    numbers = _numbers(stored)[order]
    for number, name in enumerate(_groups(stored)):
        own = np.flatnonzero(numbers == number)
        if len(own):
            low, _, high = population_band(stored, j, number)
            of = f", {name}" if stored.groups else ""
            axes.fill_betweenx(
                (own.min() - 0.5, own.max() + 0.5), low, high, alpha=LIGHT, lw=0.0,
                color=GROUP_COLORS[number % len(GROUP_COLORS)],
                label=plain(f"{stored.interval_mass:.0%} of persons{of}"),
            )  # fmt: skip


def population_band(stored: CohortPosterior, parameter: int, group: int = 0) -> tuple[float, float, float]:
    """Return lower limit, median and upper limit between which the interval's mass of a group's persons lies.

    At the cohort's mean covariates; medians over the draws of the population.
    """
    median = stored.median_of(group)[:, parameter]
    spread = stored.population.spread[0, :, parameter]
    reach = float(ndtri(interval_levels(stored.interval_mass)[1]))
    limits = [median * np.exp(side * reach * spread) for side in (-1.0, 0.0, 1.0)]
    low, middle, high = (float(np.median(limit)) for limit in limits)
    return low, middle, high
