"""Figure 3: the marginal posteriors of the whole cohort, one row a parameter.

At the left on the scale of the prior; at the right each posterior about its own median, which shows its
shape where it is much narrower than the prior.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter
from numpy.typing import NDArray

from swesbi.figures.density import log_density_of_draws, log_density_of_prior
from swesbi.figures.layout import shared_legend
from swesbi.figures.panels import PosteriorPanel
from swesbi.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    new_figure,
    style,
)
from swesbi.figures.text import percent, titled
from swesbi.intervals import median_and_interval
from swesbi.parameters import THETA_LABELS, THETA_NAMES
from swesbi.prior import ParameterPrior, PriorSettings

FloatArray = NDArray[np.float64]

ROW_HEIGHT_IN = 1.15
FRAME_HEIGHT_IN = 0.85
FRAME_WIDTH_IN = 1.3
SLOT_WIDTH_IN = 0.3
HALF_WIDTH = 0.38
FIT_OFFSET = 0.22
LONGEST_LEVEL_NAME = 3
FEWEST_SLOTS = 3
SHOWN_QUANTILES = (0.005, 0.995)


def draw(
    panels: Sequence[PosteriorPanel], prior: PriorSettings, interval: float, cohort_title: str
) -> Figure:
    """Draw the marginal posteriors of a cohort beside the prior.

    Args:
        panels: One a subject, in the order of the figure.
        prior: The prior, drawn for scale at the left.
        interval: Probability mass of the credible intervals.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is no panel.
    """
    if not panels:
        raise ValueError("no subject to draw: the cohort is empty")
    supported = [panel for panel in panels if panel.support.supported]
    slots = [len(panels) + 1] + ([max(len(supported), FEWEST_SLOTS)] if supported else [])
    with style():
        width = max(TEXT_WIDTH_IN, FRAME_WIDTH_IN + SLOT_WIDTH_IN * sum(slots))
        figure = new_figure(width, FRAME_HEIGHT_IN + ROW_HEIGHT_IN * len(THETA_NAMES))
        grid = figure.subplots(len(THETA_NAMES), len(slots), sharex="col", squeeze=False, width_ratios=slots)
        for j in range(len(THETA_NAMES)):
            _draw_on_prior_scale(grid[j, 0], panels, j, prior.parameters[j], interval)
            if supported:
                _draw_about_medians(grid[j, 1], supported, j, interval)
        _label_columns(grid, panels, supported)
        figure.suptitle(titled("Marginal posteriors", cohort_title), fontsize=7.5)
        shared_legend(figure, list(grid[:, 0]), entries_a_row=3)
    return figure


def _label_columns(
    grid: NDArray[np.object_], panels: Sequence[PosteriorPanel], supported: Sequence[PosteriorPanel]
) -> None:
    """Name the subjects below each column; long names stand upright, so that neighbours do not touch."""
    rotation = 90.0 if max(len(panel.subject) for panel in panels) > LONGEST_LEVEL_NAME else 0.0
    names = ["prior", *(panel.subject for panel in panels)]
    grid[-1, 0].set_xticks(range(len(names)), names, rotation=rotation)
    grid[0, 0].set_xlim(-0.6, len(panels) + 0.6)
    grid[0, 0].set_title("on the scale of the prior", loc="center", fontsize=6.5)
    if supported:
        shown = range(1, len(supported) + 1)
        grid[-1, 1].set_xticks(shown, [panel.subject for panel in supported], rotation=rotation)
        grid[0, 1].set_xlim(0.4, len(supported) + 0.6)
        grid[0, 1].set_title("about the median (%)", loc="right", fontsize=6.5)


def _draw_on_prior_scale(
    axes: Axes, panels: Sequence[PosteriorPanel], j: int, prior: ParameterPrior, interval: float
) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="x", length=0)
    axes.set_ylabel(THETA_LABELS[j])
    _violin(axes, 0, *log_density_of_prior(prior), PRIOR, "prior density")
    for bound in (prior.low, prior.high):
        axes.axhline(bound, color=PRIOR, lw=0.6, ls=":", zorder=0.5, label="prior bounds")
    for position, panel in enumerate(panels, start=1):
        if panel.support.supported:
            _draw_posterior(axes, position, panel.theta[:, j], interval)
        else:
            _draw_excluded(axes, position, panel.support.unfiltered_median[THETA_NAMES[j]])
        _draw_fit(axes, position, panel.fit_theta[j])


def _draw_about_medians(axes: Axes, supported: Sequence[PosteriorPanel], j: int, interval: float) -> None:
    """Draw each posterior in percent of its median; CMA-ES fits only where they lie within the axis."""
    reach = 0.0
    for position, panel in enumerate(supported, start=1):
        draws, median = panel.theta[:, j], np.median(panel.theta[:, j])
        relative = 100.0 * (draws / median - 1.0)
        theta, density = log_density_of_draws(draws)
        _violin(axes, position, 100.0 * (theta / median - 1.0), density, POSTERIOR, "posterior density")
        _interval(axes, position, relative, interval)
        reach = max(reach, *np.abs(np.quantile(relative, SHOWN_QUANTILES)))
    axes.set_ylim(-1.1 * reach or -1.0, 1.1 * reach or 1.0)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.tick_params(axis="x", length=0)
    for position, panel in enumerate(supported, start=1):
        deviation = 100.0 * (panel.fit_theta[j] / np.median(panel.theta[:, j]) - 1.0)
        if abs(deviation) <= reach:
            _draw_fit(axes, position, deviation)


def _draw_posterior(axes: Axes, position: int, draws: FloatArray, interval: float) -> None:
    _violin(axes, position, *log_density_of_draws(draws), POSTERIOR, "posterior density")
    _interval(axes, position, draws, interval)


def _interval(axes: Axes, position: int, draws: FloatArray, interval: float) -> None:
    low, median, high = median_and_interval(draws, interval)
    axes.errorbar(
        position,
        median,
        [[median - low], [high - median]],
        fmt="o",
        color="black",
        mfc="white",
        ms=3.0,
        mew=0.7,
        elinewidth=0.9,
        capsize=2.0,
        zorder=4,
        label=f"median, {percent(interval)} CI",
    )


def _draw_fit(axes: Axes, position: int, value: float) -> None:
    axes.plot(
        position + FIT_OFFSET, value, "x", color=CMAES, ms=4.0, mew=1.1, zorder=5, label="CMA-ES best fit"
    )


def _draw_excluded(axes: Axes, position: int, unfiltered_median: float) -> None:
    """Grey the subject's column; the median of all candidates shows where the estimator went."""
    axes.axvspan(position - 0.5, position + 0.5, color=EXCLUDED_BACKGROUND, lw=0, zorder=0)
    axes.plot(
        position,
        unfiltered_median,
        "D",
        color="black",
        mfc="none",
        ms=3.0,
        mew=0.7,
        label="excluded (grey): unfiltered median",
    )


def _violin(
    axes: Axes, position: int, values: FloatArray, density: FloatArray, color: str, label: str
) -> None:
    width = HALF_WIDTH * density / density.max()
    axes.fill_betweenx(
        values, position - width, position + width, color=color, alpha=0.35, lw=0.5, label=label
    )
