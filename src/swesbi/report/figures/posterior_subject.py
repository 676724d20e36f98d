"""One subject's posterior as a corner plot: on features, or exact with its proposal and the truth."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.parameters import PHI, THETA, ParameterPrior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.report.figures import density
from swesbi.report.figures.posterior import PosteriorPanel
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    NETWORK,
    PRIOR,
    TRUTH,
    color_of,
    drawing,
    shared_legend,
    titled,
)
from swesbi.report.numbers import as_percent, fixed
from swesbi.verdict.summary import verdict_numbers


def draw_corner(
    panel: PosteriorPanel, prior: PriorSettings | JointPriorSettings, cohort_title: str
) -> Figure:
    """Draw a corner plot of one posterior; of the unfiltered candidates where it may not be read.

    Draws of the proposal are outlines: where they agree with the reported ones, the weights had little to do.
    A subject that is excluded or contradicted is drawn on grey.
    """
    draws, count = panel.draws, panel.draws.shape[1]
    limits = [density.shown_range(draws[:, j], _references(panel, j)) for j in range(count)]
    side_in = 1.55 * count + 0.55
    with drawing(side_in, side_in, _title(panel, cohort_title), 8.0) as figure:
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
                axes.set_facecolor(EXCLUDED_BACKGROUND)
        figure.align_ylabels(list(grid[:, 0]))
        shared_legend(figure, [grid[0, 0]], entries_a_row=3)
    return figure


def _references(panel: PosteriorPanel, j: int) -> list[float]:
    """Return fit and truth of an active parameter: there is no passive stiffness of the same meaning."""
    points = [point for point in (panel.fit_theta, panel.truth) if point is not None]
    return [float(point[j]) for point in points] if j < len(THETA) else []


def _draw_panel(axes: Axes, panel: PosteriorPanel, prior: ParameterPrior, row: int, column: int) -> None:
    """Draw a marginal on the diagonal, a pair below it, and outlines of the proposal."""
    draws, exact, color, mass = panel.draws, panel.exact, color_of(panel.verdict), panel.interval
    if column == row:
        unread = exact is None and not panel.verdict.may_be_read
        label = "unfiltered candidates" if unread else "posterior"
        density.draw_marginal(axes, draws[:, row], prior, color, mass, label)
        if exact is not None:
            label = f"{panel.start}, {as_percent(mass)} region"
            density.draw_density(
                axes, exact.proposal_phi[:, row], color=NETWORK, lw=0.8, ls="--", label=label
            )
        return
    density.draw_pair(axes, draws[:, column], draws[:, row], color, mass)
    if exact is not None:
        x, y = exact.proposal_phi[:, column], exact.proposal_phi[:, row]
        density.draw_contours(axes, x, y, (1.0 - mass,), colors=NETWORK, linewidths=0.8, linestyles="dashed")


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
    if panel.exact is None:
        excluded = f"excluded: {reasons}; unfiltered candidates shown"
        return title if verdict.may_be_read else f"{title}\n{excluded}"
    doubt = () if panel.exact.converged else ("NOT CONVERGED: do not use this posterior",)
    return "\n".join([title, f"verdict: {verdict.status}{': ' if reasons else ''}{reasons}", *doubt])
