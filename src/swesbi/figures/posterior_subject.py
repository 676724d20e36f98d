"""One subject's posterior: marginals beside the prior, pairs of parameters, their correlations."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from swesbi.evaluation.support_numbers import support_numbers
from swesbi.figures import corner
from swesbi.figures.panels import PosteriorPanel
from swesbi.figures.style import CMAES, POSTERIOR, PRIOR, new_figure, style
from swesbi.figures.text import percent, titled
from swesbi.prior import PriorSettings

FloatArray = NDArray[np.float64]

SIDE_IN = 5.2


def draw(panel: PosteriorPanel, prior: PriorSettings, interval: float, cohort_title: str) -> Figure:
    """Draw a corner plot of one posterior; of the unfiltered candidates where the subject is excluded.

    Args:
        panel: The subject.
        prior: The prior, drawn behind the marginals, each density scaled to its maximum.
        interval: Probability mass of the credible intervals and of the outer contour.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    draws = panel.theta if panel.support.supported else _finite(panel.unfiltered)
    color = POSTERIOR if panel.support.supported else corner.EXCLUDED_COLOR
    fit = tuple(map(float, panel.fit_theta))
    limits = [corner.shown_range(draws[:, j], [fit[j]]) for j in range(3)]
    with style():
        figure = new_figure(SIDE_IN, SIDE_IN)
        grid = figure.subplots(3, 3)
        for j in range(3):
            corner.draw_marginal(grid[j, j], draws[:, j], prior.parameters[j], color, interval)
            for i in range(j):
                corner.draw_pair(grid[j, i], draws[:, i], draws[:, j], color, interval)
                grid[j, i].set_ylim(limits[j])
                corner.write_correlation(grid[i, j], draws[:, i], draws[:, j], (i, j))
        for (j, i), axes in np.ndenumerate(grid):
            corner.finish(axes, j, i, limits[i], last_row=2)
            if i <= j:
                corner.draw_bounds(axes, prior.parameters[i], limits[i])
                corner.draw_point(axes, (fit[i], fit[j] if i < j else 0.0), CMAES)
        if not panel.support.supported:
            corner.mark_excluded(grid)
        figure.suptitle(_title(panel, cohort_title), fontsize=8.0)
        figure.align_ylabels(list(grid[:, 0]))
        _legend(figure, panel, color, interval)
    return figure


def _title(panel: PosteriorPanel, cohort_title: str) -> str:
    title = titled(f"{panel.subject}, posterior of the active parameters", cohort_title)
    if panel.support.supported:
        return title
    return f"{title}\nexcluded: {', '.join(support_numbers(panel.support))}; unfiltered candidates shown"


def _finite(draws: FloatArray) -> FloatArray:
    return draws[np.all(np.isfinite(draws), axis=1)]


def _legend(figure: Figure, panel: PosteriorPanel, color: str, interval: float) -> None:
    what = "posterior" if panel.support.supported else "unfiltered candidates"
    mass = percent(interval)
    handles = [
        Line2D([], [], color=color, label=what),
        Line2D([], [], color=PRIOR, lw=4.0, alpha=0.5, label="prior (dotted: bounds)"),
        Line2D([], [], color="black", lw=0.8, label=f"median; 50 %, {mass} regions"),
        Line2D([], [], color="black", lw=0.7, ls=(0, (3, 2)), label=f"{mass} CI"),
        Line2D([], [], color=CMAES, marker="x", ls="none", mew=1.3, label="CMA-ES (triangle: beyond)"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, columnspacing=1.2, handlelength=1.6)
