"""What has changed in groups: each person's ratio alone and within the group, means, differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import gaussian_kde

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA
from swesbi.persons.change.stored_groups import EVERYONE, ChangeGroups
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    NETWORK,
    POSTERIOR,
    PRIOR,
    TRUTH,
    new_figure,
    plain,
    plain_decades,
    shared_legend,
    style,
    titled,
)

WIDTH_IN: Final = 7.2
ROW_HEIGHT_IN: Final = 0.17
FRAME_HEIGHT_IN: Final = 1.1
BELOW_HEIGHT_IN: Final = 1.4
OFFSET: Final = 0.17
MOST_DRAWN: Final = 60
"""Persons of the figure, the first ones; the table has all."""
POINTS: Final = 200
GROUP_COLORS: Final = (POSTERIOR, CMAES, TRUTH, NETWORK, DOUBTFUL)


def draw_change_groups(stored: ChangeGroups, cohort_title: str) -> Figure:
    """Draw a column a parameter: every person's ratio over the band of their group, and the posteriors below.

    Args:
        stored: What has changed.
        cohort_title: What the persons are ("virtual trial").
    """
    stored = replace(
        stored,
        person=tuple(map(plain, stored.person)),
        group=tuple(map(plain, stored.group)),
        first_group=plain(stored.first_group),
        compared_group=tuple(map(plain, stored.compared_group)),
    )
    order = _by_group(stored)[:MOST_DRAWN]
    heights = [ROW_HEIGHT_IN * len(order) + FRAME_HEIGHT_IN, BELOW_HEIGHT_IN]
    heights += [BELOW_HEIGHT_IN] if stored.groups else []
    with style():
        figure = new_figure(WIDTH_IN, sum(heights))
        grid = figure.add_gridspec(len(heights), len(THETA), height_ratios=heights)
        panels = np.array(
            [[figure.add_subplot(grid[row, j]) for j in range(len(THETA))] for row in range(len(heights))]
        )
        for j in range(len(THETA)):
            _persons(panels[0, j], stored, order, j)
            _means(panels[1, j], stored, j)
            if stored.groups:
                _differences(panels[2, j], stored, j)
        panels[0, 0].set_yticks(range(len(order)), [stored.person[d] for d in order])
        figure.suptitle(titled("What has changed, later over earlier", cohort_title), fontsize=7.5)
        shared_legend(figure, list(panels[:2].ravel()), 4)
    return figure


def _names(stored: ChangeGroups) -> tuple[str, ...]:
    return stored.groups or (EVERYONE,)


def _number(stored: ChangeGroups, person: int) -> int:
    """Return the number of a person's group among those that are compared, 0 where none are."""
    return stored.groups.index(stored.group[person]) if stored.groups else 0


def _by_group(stored: ChangeGroups) -> IntArray:
    numbers = [_number(stored, d) for d in range(len(stored.person))]
    return np.argsort(numbers, kind="stable")


def _persons(axes: Axes, stored: ChangeGroups, order: IntArray, j: int) -> None:
    at = np.arange(len(order), dtype=np.float64)
    _intervals(axes, stored.persons.before[order, :, j], at - OFFSET, PRIOR, "each person alone")
    numbers = np.array([_number(stored, int(d)) for d in order])
    for number, name in enumerate(_names(stored)):
        own = numbers == number
        color = GROUP_COLORS[number % len(GROUP_COLORS)]
        if own.any():
            low, _, high = median_and_interval(stored.ratio_of(number)[:, j], stored.interval_mass)
            span = (at[own].min() - 0.5, at[own].max() + 0.5)
            axes.fill_betweenx(span, low, high, color=color, alpha=0.16, lw=0.0)
            label = f"within the population, {name}"
            _intervals(axes, stored.persons.after[order[own], :, j], at[own] + OFFSET, color, label)
    axes.axvline(1.0, color=PRIOR, linewidth=0.6)
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.set_yticks([])
    axes.set_title(f"{THETA[j].meaning} {THETA[j].tex}", fontsize=6.5)


def _intervals(axes: Axes, limits: FloatArray, at: FloatArray, color: str, label: str) -> None:
    low, median, high = limits.T
    axes.errorbar(
        median, at, xerr=np.stack([median - low, high - median]), linestyle="none", marker="o",
        markersize=2.2, elinewidth=0.8, color=color, label=label,
    )  # fmt: skip


def _means(axes: Axes, stored: ChangeGroups, j: int) -> None:
    named = [(f"mean of {name}", stored.ratio_of(n)[:, j]) for n, name in enumerate(_names(stored))]
    _densities(axes, named, GROUP_COLORS)
    axes.set_xlabel(f"mean ratio of {THETA[j].tex}", fontsize=6.0)


def _differences(axes: Axes, stored: ChangeGroups, j: int) -> None:
    factors = stored.population.group_factor[0]
    named = [(name, factors[:, n, j]) for n, name in enumerate(stored.compared_group)]
    _densities(axes, named, GROUP_COLORS[1:])
    axes.set_xlabel(f"ratio over that of {stored.first_group}, {THETA[j].tex}", fontsize=6.0)


def _densities(axes: Axes, named: Sequence[tuple[str, FloatArray]], colors: Sequence[str]) -> None:
    """Draw the posterior of each ratio, no change marked."""
    for number, (label, draws) in enumerate(named):
        log_draws, color = np.log(draws), colors[number % len(colors)]
        grid = np.linspace(log_draws.min(), log_draws.max(), POINTS)
        density = gaussian_kde(log_draws)(grid)
        axes.plot(np.exp(grid), density, color=color, label=label)
        axes.fill_between(np.exp(grid), density, color=color, alpha=0.16, lw=0.0)
    axes.axvline(1.0, color=PRIOR, linewidth=0.6)
    axes.set_ylim(bottom=0.0)
    axes.set_yticks([])
