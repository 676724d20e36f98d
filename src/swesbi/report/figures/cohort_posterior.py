"""The posterior of a population: each member alone and within it, over its band, and the groups.

Members are subjects with theta, or persons with the ratio of theta at two visits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

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
from swesbi.report.figures.forest import (
    ENDS,
    MOST_ROWS,
    PANEL_FRAME_IN,
    ROW_HEIGHT_IN,
    Panel,
    Series,
    finish_panel,
    intervals,
    name_rows,
)
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    NETWORK,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TRUTH,
    Drawing,
    drawing,
    plain,
    shared_legend,
    titled,
)
from swesbi.verdict.verdict import Status

GROUP_COLORS: Final = (POSTERIOR, CMAES, NETWORK, DOUBTFUL, OBSERVED)
ALONE, TRUE = "alone", "truth"
DOUBTED: Final = "open: doubted or contradicted"


def draw_cohort_posterior(cohort_posterior: CohortPosterior, *, cohort_title: str) -> Drawing:
    """Draw a column a parameter: every subject alone and within the population, and the groups below."""
    panels = [Panel(parameter.meaning, parameter.label, "log") for parameter in THETA]
    return _drawn(cohort_posterior, panels, titled("The cohort as a posterior", cohort_title), "median", None)


def draw_change_groups(
    stored: CohortPosterior, *, cohort_title: str, truth: FloatArray | None = None
) -> Figure:
    """Draw a column a parameter: every person's ratio alone and within the group, and the groups below.

    ``truth`` are the ratios of the persons of a generated cohort; shape (d, 3).
    """
    head = titled("What has changed, later over earlier", cohort_title)
    panels = [Panel(each.meaning, f"{each.tex}, later over earlier", "log", mark=1.0) for each in THETA]
    return _drawn(stored, panels, head, "mean ratio", truth)


def _drawn(
    stored: CohortPosterior, panels: Sequence[Panel], title: str, middle: str, truth: FloatArray | None
) -> Figure:
    """Draw members, then what ``middle`` names of each group, then ratios of groups if these are compared."""
    order = np.argsort(_numbers(stored), kind="stable")[:MOST_ROWS]
    names = [[stored.member[d] for d in order], [f"{middle}, {name}" for name in _groups(stored)]]
    if stored.compared_group:
        names.append([f"{name} over {stored.reference_group}" for name in stored.compared_group])
    heights = [ROW_HEIGHT_IN * len(part) + PANEL_FRAME_IN for part in names]
    if stored.groups:
        title = f"{title}; groups are compared with {plain(stored.reference_group)}"
    with drawing(7.2, sum(heights) + PANEL_FRAME_IN, title) as figure:
        grid = figure.subplots(len(names), len(panels), height_ratios=heights, squeeze=False)
        for j, (column, panel) in enumerate(zip(grid.T, panels, strict=True)):
            _bands(column[0], stored, order, j)
            shown = (
                (panel, _member_rows(stored, order, truth, j)),
                (replace(panel, title=""), _group_rows(stored, truth, j, ratio=False)),
                (Panel("", "ratio of groups", "log", mark=1.0), _group_rows(stored, truth, j, ratio=True)),
            )
            for axes, part, (finished, rows) in zip(column, names, shown, strict=False):
                intervals(axes, rows, _look(stored))
                finish_panel(axes, finished)
                axes.set(yticks=[], ylim=(len(part) - 0.5, -0.5))
        for axes, part in zip(grid[:, 0], names, strict=True):
            name_rows(axes, [plain(name) for name in part])
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
    names, numbers, place = _groups(stored), _numbers(stored), np.arange(len(order))
    within = [f"{names[numbers[d]]}{'*' if doubted[d] else ''}" for d in order]
    parts: list[tuple[Any, ...]] = [
        (place - 0.17, ALONE, stored.members.before[order, :, j]),
        (place + 0.17, within, stored.members.after[order, :, j]),
    ]
    if truth is not None:
        parts.append((place + 0.17, TRUE, truth[order][:, [j] * len(ENDS)]))
    return pd.concat(
        pd.DataFrame(ends, columns=list(ENDS)).assign(row=row, series=series) for row, series, ends in parts
    )


def _group_rows(stored: CohortPosterior, truth: FloatArray | None, j: int, *, ratio: bool) -> pd.DataFrame:
    """Return the intervals of the medians of groups, or of their ratios to the reference, and the truth."""
    numbers, rows = _numbers(stored), []
    for number, name in list(enumerate(_groups(stored)))[int(ratio) :]:
        draws = stored.median_of(number)[:, j]
        true = np.nan if truth is None else float(np.log(truth[numbers == number, j]).mean())
        if ratio:
            draws = draws / stored.median_of(0)[:, j]
            true -= np.nan if truth is None else float(np.log(truth[numbers == 0, j]).mean())
        rows.append((number - ratio, name, *median_and_interval(draws, stored.interval_mass)))
        rows.append((number - ratio, TRUE, *[np.exp(true)] * 3))
    return pd.DataFrame(rows, columns=["row", "series", *ENDS])


def _bands(axes: Axes, stored: CohortPosterior, order: IntArray, j: int) -> None:
    """Shade where the interval's mass of the persons of each group lies.

    At the cohort's mean covariates; medians over the draws of the population.
    """
    numbers = _numbers(stored)[order]
    reach = float(ndtri(interval_levels(stored.interval_mass)[1]))
    for number, name in enumerate(_groups(stored)):
        own = np.flatnonzero(numbers == number)
        if len(own):
            median, spread = stored.median_of(number)[:, j], stored.population.spread[0, :, j]
            low, high = (float(np.median(median * np.exp(side * reach * spread))) for side in (-1.0, 1.0))
            of = f", {name}" if stored.groups else ""
            axes.fill_betweenx(
                (own.min() - 0.5, own.max() + 0.5), low, high, alpha=0.16, lw=0.0,
                color=GROUP_COLORS[number % len(GROUP_COLORS)],
                label=plain(f"{stored.interval_mass:.0%} of persons{of}"),
            )  # fmt: skip
