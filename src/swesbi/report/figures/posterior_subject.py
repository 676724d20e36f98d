"""One subject's posterior as a corner plot: on features, or exact with its proposal and the truth."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.parameters import PHI, THETA
from swesbi.prior import JointPriorSettings, ParameterPrior, PriorSettings
from swesbi.report.figures import density
from swesbi.report.figures.posterior import PosteriorPanel
from swesbi.report.figures.style import (
    CMAES,
    NETWORK,
    PRIOR,
    TRUTH,
    mark_excluded,
    new_figure,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent, fixed
from swesbi.verdict.summary import verdict_numbers

SIDE_IN: Final = 1.55
FRAME_IN: Final = 0.55


def draw_corner(
    panel: PosteriorPanel, prior: PriorSettings | JointPriorSettings, cohort_title: str
) -> Figure:
    """Draw a corner plot of one posterior; of the unfiltered candidates where it may not be read.

    Draws of the proposal are outlines: where they agree with the reported ones, the weights had little to do.
    A subject that is excluded or contradicted is drawn on grey.

    Args:
        panel: The subject.
        prior: Of all parameters, drawn behind the marginals, each density scaled to its maximum.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    draws, count = panel.draws, panel.draws.shape[1]
    limits = [density.shown_range(draws[:, j], _references(panel, j)) for j in range(count)]
    with style():
        figure = new_figure(SIDE_IN * count + FRAME_IN, SIDE_IN * count + FRAME_IN)
        grid = np.asarray(figure.subplots(count, count))
        for (row, column), axes in np.ndenumerate(grid):
            if column > row:
                _write_correlation(axes, panel, row, column)
                continue
            _draw_panel(axes, panel, prior.parameters[row], row, column)
            if column < row:
                axes.set_ylim(limits[row])
            density.finish_corner(axes, (row, column), limits[column], last=count - 1)
            _draw_lines(axes, panel, prior.parameters[column], row, column)
            if not panel.verdict.may_be_read:
                mark_excluded(axes)
        figure.suptitle(_title(panel, cohort_title), fontsize=8.0)
        figure.align_ylabels(list(grid[:, 0]))
        shared_legend(figure, [grid[0, 0]], entries_a_row=3)
    return figure


def _references(panel: PosteriorPanel, j: int) -> list[float]:
    """Return fit and truth of an active parameter: there is no passive stiffness of the same meaning."""
    points = [point for point in (panel.fit_theta, panel.truth) if point is not None]
    return [float(point[j]) for point in points] if j < len(THETA) else []


def _draw_panel(axes: Axes, panel: PosteriorPanel, prior: ParameterPrior, row: int, column: int) -> None:
    """Draw a marginal on the diagonal, a pair below it, and outlines of the proposal."""
    draws, proposal, color, mass = panel.draws, panel.proposal, panel.color, panel.interval
    if column == row:
        unread = proposal is None and not panel.verdict.may_be_read
        label = "unfiltered candidates" if unread else "posterior"
        density.draw_marginal(axes, draws[:, row], prior, color, mass, label)
        if proposal is not None:
            look = {
                "color": NETWORK,
                "lw": 0.8,
                "ls": "--",
                "label": f"{panel.start}, {as_percent(mass)} region",
            }
            density.draw_density(axes, proposal[:, row], **look)
        return
    density.draw_pair(axes, draws[:, column], draws[:, row], color, mass)
    if proposal is not None:
        look = {"colors": NETWORK, "linewidths": 0.8, "linestyles": "dashed"}
        density.draw_contours(axes, proposal[:, column], proposal[:, row], (1.0 - mass,), **look)


def _draw_lines(axes: Axes, panel: PosteriorPanel, prior: ParameterPrior, row: int, column: int) -> None:
    """Draw the prior's bounds in view, and fit and truth: points in pairs, on the axis in marginals."""
    left, right = axes.get_xlim()
    for bound in (prior.low, prior.high):
        if left < bound < right:
            axes.axvline(bound, color=PRIOR, lw=0.9, ls=":", zorder=0.5)
    if row >= len(THETA):
        return
    for point, color, marker, label in (
        (panel.fit_theta, CMAES, "x", "CMA-ES fit"),
        (panel.truth, TRUTH, "*", "truth"),
    ):
        if point is not None:
            place = (float(point[column]), float(point[row]) if column < row else 0.0)
            density.draw_point(axes, place, color, marker, f"{label} (triangle: beyond)")


def _write_correlation(axes: Axes, panel: PosteriorPanel, row: int, column: int) -> None:
    axes.set_axis_off()
    r = fixed(float(np.corrcoef(panel.draws[:, row], panel.draws[:, column])[0, 1]), 2)
    text = f"correlation of\n{PHI[row].tex}, {PHI[column].tex}:\n{r}"
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=7.0)


def _title(panel: PosteriorPanel, cohort_title: str) -> str:
    """Return what is shown, what speaks against it, and a warning where the sampler has not converged."""
    verdict, title = panel.verdict, titled(f"{panel.subject}, posterior", cohort_title)
    reasons = ", ".join(verdict_numbers(verdict))
    if panel.proposal is None:
        excluded = f"excluded: {reasons}; unfiltered candidates shown"
        return title if verdict.may_be_read else f"{title}\n{excluded}"
    doubt = () if panel.converged else ("NOT CONVERGED: do not use this posterior",)
    return "\n".join([title, f"verdict: {verdict.status}{': ' if reasons else ''}{reasons}", *doubt])
