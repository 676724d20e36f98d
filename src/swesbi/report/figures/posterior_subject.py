"""One subject's posterior as a corner plot: on features, or exact with verdict and truth."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from swesbi.parameters import PHI, THETA
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.report.figures import density
from swesbi.report.figures.predictive import ExactPanel, PosteriorPanel
from swesbi.report.figures.style import (
    CMAES,
    NETWORK,
    POSTERIOR,
    PRIOR,
    STATUS_COLORS,
    TRUTH,
    new_figure,
    style,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.verdict.prior_support import support_numbers
from swesbi.verdict.summary import verdict_numbers

FloatArray = NDArray[np.float64]

SIDE_IN = 5.2
EXACT_SIDE_IN = 6.2
PARAMETERS = len(PHI)
ACTIVE = len(THETA)  # fit and truth have no passive stiffness that would be the same quantity


def draw_subject_posterior(
    panel: PosteriorPanel, prior: PriorSettings, interval: float, cohort_title: str
) -> Figure:
    """Draw a corner plot of one posterior; of the unfiltered candidates where the subject is excluded.

    Args:
        panel: The subject.
        prior: The prior, drawn behind the marginals, each density scaled to its maximum.
        interval: Probability mass of the credible intervals and of the outer contour.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    draws = panel.theta if panel.verdict.may_be_read else _finite(panel.unfiltered)
    color = POSTERIOR if panel.verdict.may_be_read else density.EXCLUDED_COLOR
    fit = tuple(map(float, panel.fit_theta))
    limits = [density.shown_range(draws[:, j], [fit[j]]) for j in range(ACTIVE)]
    with style():
        figure = new_figure(SIDE_IN, SIDE_IN)
        grid = figure.subplots(ACTIVE, ACTIVE)
        for j in range(ACTIVE):
            density.draw_marginal(grid[j, j], draws[:, j], prior.parameters[j], color, interval)
            for i in range(j):
                density.draw_pair(grid[j, i], draws[:, i], draws[:, j], color, interval)
                grid[j, i].set_ylim(limits[j])
                density.write_correlation(grid[i, j], draws[:, i], draws[:, j], (i, j))
        for (j, i), axes in np.ndenumerate(grid):
            density.finish(axes, j, i, limits[i], last_row=ACTIVE - 1)
            if i <= j:
                density.draw_bounds(axes, prior.parameters[i], limits[i])
                density.draw_point(axes, (fit[i], fit[j] if i < j else 0.0), CMAES)
        if not panel.verdict.may_be_read:
            density.mark_excluded(grid)
        figure.suptitle(_title(panel, cohort_title), fontsize=8.0)
        figure.align_ylabels(list(grid[:, 0]))
        _legend(figure, panel, color, interval)
    return figure


def _title(panel: PosteriorPanel, cohort_title: str) -> str:
    title = titled(f"{panel.subject}, posterior of the active parameters", cohort_title)
    if panel.verdict.may_be_read:
        return title
    return f"{title}\nexcluded: {', '.join(support_numbers(panel.verdict))}; unfiltered candidates shown"


def _finite(draws: FloatArray) -> FloatArray:
    return draws[np.all(np.isfinite(draws), axis=1)]


def _legend(figure: Figure, panel: PosteriorPanel, color: str, interval: float) -> None:
    what = "posterior" if panel.verdict.may_be_read else "unfiltered candidates"
    mass = as_percent(interval)
    handles = [
        Line2D([], [], color=color, label=what),
        *_common_handles(mass),
        _fit_handle(),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, columnspacing=1.2, handlelength=1.6)


def draw_exact_subject(panel: ExactPanel, prior: JointPriorSettings, cohort_title: str) -> Figure:
    """Draw a corner plot of the exact posterior of the active parameters and the passive stiffness.

    The network's own draws, or those of the prior where there was no network, are outlines: where they agree
    with the reported ones, the weights had little to do. A contradicted subject is drawn on grey.

    Args:
        panel: The subject.
        prior: The joint prior, drawn behind the marginals, each density scaled to its maximum.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    phi, color = panel.result.phi, STATUS_COLORS[panel.verdict.status]
    limits = [density.shown_range(phi[:, j], _points(panel, j)) for j in range(PARAMETERS)]
    with style():
        figure = new_figure(EXACT_SIDE_IN, EXACT_SIDE_IN)
        grid = figure.subplots(PARAMETERS, PARAMETERS)
        for j in range(PARAMETERS):
            _draw_column(grid, panel, prior, j, color)
            for i in range(j):
                grid[j, i].set_ylim(limits[j])
        for (j, i), axes in np.ndenumerate(grid):
            density.finish(axes, j, i, limits[i], last_row=PARAMETERS - 1)
            if i <= j:
                density.draw_bounds(axes, prior.parameters[i], limits[i])
                _draw_references(axes, panel, i, j)
        if not panel.verdict.may_be_read:
            density.mark_excluded(grid)
        figure.suptitle(_exact_title(panel, cohort_title), fontsize=8.0)
        figure.align_ylabels(list(grid[:, 0]))
        _exact_legend(figure, panel, color)
    return figure


def _points(panel: ExactPanel, j: int) -> list[float]:
    points = [point for point in (panel.fit_theta, panel.truth) if point is not None]
    return [float(point[j]) for point in points] if j < ACTIVE else []


def _draw_column(
    grid: NDArray[np.object_], panel: ExactPanel, prior: JointPriorSettings, j: int, color: str
) -> None:
    """Draw one parameter's marginal and its pairs with those before it."""
    phi, npe, mass = panel.result.phi, panel.result.proposal_phi, panel.result.interval_mass
    density.draw_marginal(grid[j, j], phi[:, j], prior.parameters[j], color, mass)
    density.draw_density(grid[j, j], npe[:, j], color=NETWORK, lw=0.8, ls="--")
    for i in range(j):
        density.draw_pair(grid[j, i], phi[:, i], phi[:, j], color, mass)
        look = {"colors": NETWORK, "linewidths": 0.8, "linestyles": "dashed"}
        density.draw_contours(grid[j, i], npe[:, i], npe[:, j], (1.0 - mass,), **look)
        density.write_correlation(grid[i, j], phi[:, i], phi[:, j], (i, j))


def _draw_references(axes: Axes, panel: ExactPanel, i: int, j: int) -> None:
    """Draw the reference fit and the truth: points in pairs, on the axis in marginals."""
    if max(i, j) >= ACTIVE:
        return
    if panel.fit_theta is not None:
        density.draw_point(axes, (panel.fit_theta[i], panel.fit_theta[j] if i < j else 0.0), CMAES)
    if panel.truth is not None:
        density.draw_point(axes, (panel.truth[i], panel.truth[j] if i < j else 0.0), TRUTH, "*")


def _exact_title(panel: ExactPanel, cohort_title: str) -> str:
    """Return what is shown, the verdict, and a warning where the sampler has not converged."""
    verdict = panel.verdict
    reasons = ": ".join([verdict.status, ", ".join(verdict_numbers(verdict))]).removesuffix(": ")
    doubt = () if panel.result.converged else ("NOT CONVERGED: do not use this posterior",)
    title = titled(f"{panel.subject}, exact posterior", cohort_title)
    return "\n".join([title, f"verdict: {reasons}", *doubt])


def _exact_legend(figure: Figure, panel: ExactPanel, color: str) -> None:
    mass = as_percent(panel.result.interval_mass)
    handles = [
        Line2D([], [], color=color, label=f"exact posterior ({panel.verdict.status})"),
        Line2D([], [], color=NETWORK, lw=0.8, ls="--", label=f"{panel.start}, {mass} region"),
        *_common_handles(mass),
        *(() if panel.fit_theta is None else (_fit_handle(),)),
    ]
    if panel.truth is not None:
        handles.append(
            Line2D([], [], color=TRUTH, marker="*", ls="none", label="truth of the generated recording")
        )
    figure.legend(handles=handles, loc="outside lower center", ncols=3, columnspacing=1.2, handlelength=1.6)


def _common_handles(mass: str) -> list[Line2D]:
    return [
        Line2D([], [], color=PRIOR, lw=4.0, alpha=0.5, label="prior (dotted: bounds)"),
        Line2D([], [], color="black", lw=0.8, label=f"median; 50 %, {mass} regions"),
        Line2D([], [], color="black", lw=0.7, ls=(0, (3, 2)), label=f"{mass} CI"),
    ]


def _fit_handle() -> Line2D:
    return Line2D([], [], color=CMAES, marker="x", ls="none", mew=1.3, label="CMA-ES (triangle: beyond)")
