"""Figure 3: the marginal posteriors of the whole cohort, one row a parameter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter
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
from swesbi.simulations.prior import ParameterPrior, PriorSettings
from swesbi.theta import THETA_LABELS, THETA_NAMES

FloatArray = NDArray[np.float64]

ROW_HEIGHT_IN = 1.15
FRAME_HEIGHT_IN = 0.85
SUBJECT_WIDTH_IN = 0.55
HALF_WIDTH = 0.38
FIT_OFFSET = 0.2
LONGEST_LEVEL_NAME = 8


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
    with style():
        width = max(TEXT_WIDTH_IN, SUBJECT_WIDTH_IN * (len(panels) + 1) + 0.6)
        figure = new_figure(width, FRAME_HEIGHT_IN + ROW_HEIGHT_IN * len(THETA_NAMES))
        rows = list(figure.subplots(len(THETA_NAMES), 1, sharex=True))
        for j, axes in enumerate(rows):
            _draw_row(axes, panels, j, prior.parameters[j], interval)
            axes.set_ylabel(THETA_LABELS[j])
        rows[-1].set_xticks(
            range(len(panels) + 1), ["prior", *map(_tick, panels)], rotation=_rotation(panels)
        )
        rows[0].set_xlim(-0.6, len(panels) + 0.6)
        figure.align_ylabels(rows)
        figure.suptitle(titled("Marginal posteriors", cohort_title), fontsize=7.5)
        shared_legend(figure, rows, entries_a_row=3)
    return figure


def _tick(panel: PosteriorPanel) -> str:
    return panel.subject if panel.support.supported else f"{panel.subject}\n(excluded)"


def _rotation(panels: Sequence[PosteriorPanel]) -> float:
    """Long names stand upright, so that neighbours do not touch."""
    return 90.0 if max(len(panel.subject) for panel in panels) > LONGEST_LEVEL_NAME else 0.0


def _draw_row(
    axes: Axes, panels: Sequence[PosteriorPanel], j: int, prior: ParameterPrior, interval: float
) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="x", length=0)
    _violin(axes, 0, *log_density_of_prior(prior), PRIOR, "prior density")
    for bound in (prior.low, prior.high):
        axes.axhline(bound, color=PRIOR, lw=0.6, ls=":", zorder=0.5, label="prior bounds")
    for position, panel in enumerate(panels, start=1):
        if panel.support.supported:
            _draw_posterior(axes, position, panel.theta[:, j], interval)
        else:
            _draw_excluded(axes, position, panel.support.unfiltered_median[THETA_NAMES[j]])
        axes.plot(
            position, panel.fit_theta[j], "x", color=CMAES, ms=4.5, mew=1.2, zorder=5, label="CMA-ES best fit"
        )


def _draw_posterior(axes: Axes, position: int, draws: FloatArray, interval: float) -> None:
    _violin(axes, position, *log_density_of_draws(draws), POSTERIOR, "posterior density")
    tail = (1.0 - interval) / 2.0
    low, median, high = np.quantile(draws, [tail, 0.5, 1.0 - tail])
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
        label="excluded: unfiltered median",
    )


def _violin(
    axes: Axes, position: int, theta: FloatArray, density: FloatArray, color: str, label: str
) -> None:
    width = HALF_WIDTH * density / density.max()
    axes.fill_betweenx(
        theta, position - width, position + width, color=color, alpha=0.35, lw=0.5, label=label
    )
