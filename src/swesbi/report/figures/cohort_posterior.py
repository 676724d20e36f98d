"""The posterior of a cohort: each subject alone and within the population, and the groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.special import ndtri

from swesbi.draws import interval_levels
from swesbi.parameters import THETA
from swesbi.persons.cohort.result import CohortPosterior
from swesbi.persons.cohort.table import group_median
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    NETWORK,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    STATUS_COLORS,
    TRUTH,
    Drawing,
    new_figure,
    plain,
    plain_decades,
    shared_legend,
    style,
    titled,
)

FloatArray = NDArray[np.float64]
WIDTH_IN: Final = 7.2
ROW_HEIGHT_IN: Final = 0.19
FRAME_HEIGHT_IN: Final = 1.1
GROUP_HEIGHT_IN: Final = 1.35
OFFSET: Final = 0.17
LIGHT: Final = 0.16
BINS: Final = 30
MOST_DRAWN: Final = 40
"""Subjects of the figure, the first ones; the table has all."""
GROUP_COLORS: Final = (POSTERIOR, CMAES, TRUTH, NETWORK, DOUBTFUL, OBSERVED)


def draw_cohort_posterior(cohort_posterior: CohortPosterior, *, cohort_title: str) -> Drawing:
    """Draw a panel a parameter: every subject alone and within the population, over the population's band.

    Where groups are compared, each parameter's median by group and their ratio follow below.

    Args:
        cohort_posterior: The posterior of the cohort.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    posterior = replace(
        cohort_posterior,
        first_group=plain(cohort_posterior.first_group),
        compared_group=tuple(map(plain, cohort_posterior.compared_group)),
    )
    shown = min(len(posterior.subject), MOST_DRAWN)
    first = ROW_HEIGHT_IN * shown + FRAME_HEIGHT_IN
    heights = [first] + [GROUP_HEIGHT_IN] * (2 if posterior.groups else 0)
    with style():
        figure = new_figure(WIDTH_IN, sum(heights))
        grid = figure.add_gridspec(len(heights), len(THETA), height_ratios=heights)
        panels = [figure.add_subplot(grid[0, j]) for j in range(len(THETA))]
        for j, axes in enumerate(panels):
            _subjects(axes, posterior, j, shown)
        panels[0].set_yticks(range(shown), posterior.subject[:shown])
        below = []
        if posterior.groups:
            below = [[figure.add_subplot(grid[row, j]) for j in range(len(THETA))] for row in (1, 2)]
            _groups(below[0], below[1], posterior)
        figure.suptitle(titled("The cohort as a posterior", cohort_title), fontsize=7.5)
        shared_legend(figure, [*panels, *(below[0] if below else [])], 4)
    return figure


def _subjects(axes: Axes, posterior: CohortPosterior, j: int, shown: int) -> None:
    low, middle, high = population_band(posterior, j)
    of = f", group {posterior.first_group}" if posterior.groups else ""
    axes.axvspan(low, high, color=PRIOR, alpha=LIGHT, linewidth=0.0, label=f"the population{of}")
    axes.axvline(middle, color=PRIOR, linewidth=0.8)
    rows = np.arange(shown, dtype=np.float64)
    before, after = posterior.subjects.before[:shown, :, j], posterior.subjects.after[:shown, :, j]
    _intervals(axes, before, rows - OFFSET, PRIOR, "each subject alone")
    verdicts = np.array(posterior.verdict[:shown])
    for verdict, color in STATUS_COLORS.items():
        of_verdict = verdicts == verdict
        if of_verdict.any():
            label = f"within the population, {verdict}"
            _intervals(axes, after[of_verdict], rows[of_verdict] + OFFSET, color, label)
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    axes.set_ylim(shown - 0.5, -0.5)
    axes.set_yticks([])
    axes.set_title(THETA[j].label, fontsize=6.5)


def population_band(posterior: CohortPosterior, parameter: int) -> tuple[float, float, float]:
    """Return lower limit, median and upper limit between which the interval's mass of persons lies.

    At the cohort's mean covariates, of the first group; medians over the draws of the population.
    """
    median = posterior.population.median[0, :, parameter]
    spread = posterior.population.spread[0, :, parameter]
    reach = float(ndtri(interval_levels(posterior.interval_mass)[1]))
    limits = [median * np.exp(side * reach * spread) for side in (-1.0, 0.0, 1.0)]
    low, middle, high = (float(np.median(limit)) for limit in limits)
    return low, middle, high


def _intervals(axes: Axes, limits: FloatArray, at: FloatArray, color: str, label: str) -> None:
    low, median, high = limits.T
    axes.errorbar(
        median, at, xerr=np.stack([median - low, high - median]), linestyle="none", marker="o",
        markersize=2.2, elinewidth=0.8, color=color, label=label,
    )  # fmt: skip


def _groups(medians: Sequence[Axes], ratios: Sequence[Axes], posterior: CohortPosterior) -> None:
    for j, (above, below) in enumerate(zip(medians, ratios, strict=True)):
        for number, name in enumerate(posterior.groups):
            color = GROUP_COLORS[number % len(GROUP_COLORS)]
            draws = np.log(group_median(posterior, number, j))
            label = f"group {name}"
            above.hist(
                np.exp(draws), bins=_bins(draws), histtype="step", density=True, color=color, label=label
            )
        for number in range(len(posterior.compared_group)):
            color = GROUP_COLORS[(number + 1) % len(GROUP_COLORS)]
            draws = np.log(posterior.population.group_factor[0, :, number, j])
            below.hist(np.exp(draws), bins=_bins(draws), histtype="step", density=True, color=color)
        below.axvline(1.0, color=PRIOR, linewidth=0.7)
        above.set_xlabel(f"median of a group, {THETA[j].label}", fontsize=6.0)
        below.set_xlabel(f"{THETA[j].tex} over that of {posterior.first_group}", fontsize=6.0)
        for axes in (above, below):
            axes.set_yticks([])


def _bins(log_draws: FloatArray) -> list[float]:
    return [float(edge) for edge in np.exp(np.linspace(log_draws.min(), log_draws.max(), BINS))]
