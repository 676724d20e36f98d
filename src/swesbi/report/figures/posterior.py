"""The marginal posteriors of a whole cohort, one row a parameter.

Of an experiment on features (figure 3) at the left on the scale of the prior, at the right each about its own
median, which shows its shape where it is much narrower than the prior; exact ones with how reliable each is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_LABELS, THETA_LABELS, THETA_NAMES
from swesbi.prior import JointPriorSettings, ParameterPrior, PriorSettings
from swesbi.report.figures.density import log_density_of_draws, log_density_of_prior
from swesbi.report.figures.predictive import ExactPanel, PosteriorPanel
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    NETWORK,
    POSTERIOR,
    PRIOR,
    STATUS_COLORS,
    TEXT_WIDTH_IN,
    TRUTH,
    new_figure,
    plain_decades,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.verdict.verdict import Status

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
PARAMETERS = len(PHI_LABELS)
ACTIVE = len(THETA_LABELS)
EXACT_ROW_HEIGHT_IN = 1.0
EXACT_FRAME_HEIGHT_IN = 1.3
EXACT_FRAME_WIDTH_IN = 1.2
EXACT_SLOT_WIDTH_IN = 0.5
RELIABILITY = 0.6
OFFSET = 0.24
TOP_K_HAT = 1.15
EXACT_SHOWN_QUANTILES = (0.002, 0.998)


def draw_cohort_posteriors(
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
    read = [panel for panel in panels if panel.verdict.may_be_read]
    slots = [len(panels) + 1] + ([max(len(read), FEWEST_SLOTS)] if read else [])
    with style():
        width = max(TEXT_WIDTH_IN, FRAME_WIDTH_IN + SLOT_WIDTH_IN * sum(slots))
        figure = new_figure(width, FRAME_HEIGHT_IN + ROW_HEIGHT_IN * len(THETA_NAMES))
        grid = figure.subplots(len(THETA_NAMES), len(slots), sharex="col", squeeze=False, width_ratios=slots)
        for j in range(len(THETA_NAMES)):
            _draw_on_prior_scale(grid[j, 0], panels, j, prior.parameters[j], interval)
            if read:
                _draw_about_medians(grid[j, 1], read, j, interval)
        _label_columns(grid, panels, read)
        figure.suptitle(titled("Marginal posteriors", cohort_title), fontsize=7.5)
        shared_legend(figure, list(grid[:, 0]), entries_a_row=3)
    return figure


def _label_columns(
    grid: NDArray[np.object_], panels: Sequence[PosteriorPanel], read: Sequence[PosteriorPanel]
) -> None:
    """Name the subjects below each column; long names stand upright, so that neighbours do not touch."""
    rotation = 90.0 if max(len(panel.subject) for panel in panels) > LONGEST_LEVEL_NAME else 0.0
    names = ["prior", *(panel.subject for panel in panels)]
    grid[-1, 0].set_xticks(range(len(names)), names, rotation=rotation)
    grid[0, 0].set_xlim(-0.6, len(panels) + 0.6)
    grid[0, 0].set_title("on the scale of the prior", loc="center", fontsize=6.5)
    if read:
        shown = range(1, len(read) + 1)
        grid[-1, 1].set_xticks(shown, [panel.subject for panel in read], rotation=rotation)
        grid[0, 1].set_xlim(0.4, len(read) + 0.6)
        grid[0, 1].set_title("about the median (%)", loc="right", fontsize=6.5)


def _draw_on_prior_scale(
    axes: Axes, panels: Sequence[PosteriorPanel], j: int, prior: ParameterPrior, interval: float
) -> None:
    _prior_scale(axes, prior)
    axes.tick_params(axis="x", length=0)
    axes.set_ylabel(THETA_LABELS[j])
    for position, panel in enumerate(panels, start=1):
        if panel.verdict.may_be_read:
            _draw_posterior(axes, position, panel.theta[:, j], interval)
        else:
            _draw_excluded(axes, position, panel.verdict.unfiltered_median[THETA_NAMES[j]])
        _draw_fit(axes, position, panel.fit_theta[j])


def _draw_about_medians(axes: Axes, read: Sequence[PosteriorPanel], j: int, interval: float) -> None:
    """Draw each posterior in percent of its median; CMA-ES fits only where they lie within the axis."""
    reach = 0.0
    for position, panel in enumerate(read, start=1):
        draws, median = panel.theta[:, j], np.median(panel.theta[:, j])
        relative = 100.0 * (draws / median - 1.0)
        theta, density = log_density_of_draws(draws)
        _violin(axes, position, 100.0 * (theta / median - 1.0), density, POSTERIOR, "posterior density")
        _interval(axes, position, relative, interval)
        reach = max(reach, *np.abs(np.quantile(relative, SHOWN_QUANTILES)))
    axes.set_ylim(-1.1 * reach or -1.0, 1.1 * reach or 1.0)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.tick_params(axis="x", length=0)
    for position, panel in enumerate(read, start=1):
        deviation = 100.0 * (panel.fit_theta[j] / np.median(panel.theta[:, j]) - 1.0)
        if abs(deviation) <= reach:
            _draw_fit(axes, position, deviation)


def _draw_posterior(axes: Axes, position: int, draws: FloatArray, interval: float) -> None:
    _violin(axes, position, *log_density_of_draws(draws), POSTERIOR, "posterior density")
    _interval(axes, position, draws, interval)


def _interval(axes: Axes, position: int, draws: FloatArray, interval: float, size: float = 3.0) -> None:
    low, median, high = median_and_interval(draws, interval)
    mark: dict[str, Any] = {"fmt": "o", "color": "black", "mfc": "white", "ms": size, "mew": 0.7, "zorder": 4}
    ends, label = [[median - low], [high - median]], f"median, {as_percent(interval)} CI"
    axes.errorbar(position, median, ends, elinewidth=0.9, capsize=2.0, label=label, **mark)


def _draw_fit(axes: Axes, position: int, value: float) -> None:
    axes.plot(
        position + FIT_OFFSET, value, "x", color=CMAES, ms=4.0, mew=1.1, zorder=5, label="CMA-ES best fit"
    )


def _draw_excluded(axes: Axes, position: int, unfiltered_median: float) -> None:
    """Grey the subject's column; the median of all candidates shows where the estimator went."""
    axes.axvspan(position - 0.5, position + 0.5, color=EXCLUDED_BACKGROUND, lw=0, zorder=0)
    label = "excluded (grey): unfiltered median"
    axes.plot(position, unfiltered_median, "D", color="black", mfc="none", ms=3.0, mew=0.7, label=label)


def _violin(
    axes: Axes,
    position: int,
    values: FloatArray,
    density: FloatArray,
    color: str,
    label: str,
    exact: bool = False,
) -> None:
    """Draw a density both ways from its place; of an exact posterior darker and without an edge."""
    width = HALF_WIDTH * density / density.max()
    alpha, edge = (0.4, 0.0) if exact else (0.35, 0.5)
    axes.fill_betweenx(
        values, position - width, position + width, color=color, alpha=alpha, lw=edge, label=label
    )


def _prior_scale(axes: Axes, prior: ParameterPrior, exact: bool = False) -> None:
    """Draw the prior and its bounds on a logarithmic axis."""
    axes.set_yscale("log")
    plain_decades(axes.yaxis)
    _violin(axes, 0, *log_density_of_prior(prior), PRIOR, "prior density", exact)
    for bound in (prior.low, prior.high):
        axes.axhline(bound, color=PRIOR, lw=0.6, ls=":", zorder=0.5, label="prior bounds")


def draw_exact_posteriors(
    panels: Sequence[ExactPanel], prior: JointPriorSettings, cohort_title: str
) -> Figure:
    """Draw the marginals of every subject beside the prior, then Pareto shape and efficiency of the weights.

    The colour of a posterior is its verdict; the network's own draws are outlines.

    Args:
        panels: One a subject, in the order of the figure.
        prior: The joint prior, drawn for scale.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is no panel.
    """
    if not panels:
        raise ValueError("no subject to draw: the cohort is empty")
    heights = [1.0] * PARAMETERS + [RELIABILITY] * 2
    with style():
        width = max(TEXT_WIDTH_IN, EXACT_FRAME_WIDTH_IN + EXACT_SLOT_WIDTH_IN * (len(panels) + 1))
        figure = new_figure(width, EXACT_FRAME_HEIGHT_IN + EXACT_ROW_HEIGHT_IN * sum(heights))
        rows = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        for j in range(PARAMETERS):
            _draw_parameter(rows[j], panels, j, prior.parameters[j])
        _draw_shapes(rows[PARAMETERS], panels)
        _draw_efficiencies(rows[PARAMETERS + 1], panels)
        for axes in rows:
            axes.tick_params(axis="x", length=0)
            _shade(axes, panels)
        _name_subjects(rows[-1], panels)
        figure.align_ylabels(list(rows))
        figure.suptitle(titled("Exact posteriors", cohort_title), fontsize=7.5)
        shared_legend(figure, [rows[0], rows[PARAMETERS], rows[-1]], entries_a_row=3)
    return figure


def _draw_parameter(axes: Axes, panels: Sequence[ExactPanel], j: int, prior: ParameterPrior) -> None:
    _prior_scale(axes, prior, exact=True)
    axes.set_ylabel(PHI_LABELS[j].replace(" (", "\n("))
    for position, panel in enumerate(panels, start=1):
        verdict = panel.verdict.status
        phi = panel.result.phi[:, j]
        density = log_density_of_draws(phi)
        _violin(axes, position, *density, STATUS_COLORS[verdict], f"posterior, {verdict}", exact=True)
        _outline(axes, position, *log_density_of_draws(_nearly_all(panel.result.proposal_phi[:, j])))
        _interval(axes, position, phi, panel.result.interval_mass, size=2.8)
        if j < ACTIVE:
            _draw_references(axes, position, panel, j)


def _draw_references(axes: Axes, position: int, panel: ExactPanel, j: int) -> None:
    """Draw the reference fit at the right of a posterior, the truth at its left."""
    if panel.fit_theta is not None:
        cross: dict[str, Any] = {"color": CMAES, "ms": 4.0, "mew": 1.1, "zorder": 5, "label": "CMA-ES fit"}
        axes.plot(position + OFFSET, panel.fit_theta[j], "x", **cross)
    if panel.truth is not None:
        label = "truth (generated)"
        axes.plot(position - OFFSET, panel.truth[j], "*", color=TRUTH, ms=5, mew=0, zorder=5, label=label)


def _nearly_all(draws: FloatArray) -> FloatArray:
    """Return the draws without the farthest, which would draw an outline out into a needle."""
    low, high = np.quantile(draws, EXACT_SHOWN_QUANTILES)
    return np.asarray(draws[(draws >= low) & (draws <= high)])


def _outline(axes: Axes, position: int, values: FloatArray, density: FloatArray) -> None:
    width = HALF_WIDTH * density / density.max()
    for side in (-1.0, 1.0):
        axes.plot(position + side * width, values, color=NETWORK, lw=0.6, ls="--", label="network alone")


def _draw_shapes(axes: Axes, panels: Sequence[ExactPanel]) -> None:
    """Draw the Pareto shape of each subject's weights; one beyond the axis as a triangle."""
    limit = panels[0].result.k_hat_limit
    axes.axhline(limit, color=CMAES, lw=0.7, ls="--", label="limit of k-hat")
    for position, panel in enumerate(panels, start=1):
        value = panel.result.k_hat
        beyond = not value <= TOP_K_HAT
        marker = "^" if beyond else ("s" if panel.result.by_mcmc else "o")
        axes.plot(position, TOP_K_HAT if beyond else value, marker, color="black", ms=3.2, clip_on=False)
    axes.plot([], [], "o", color="black", ms=3.2, label="draws by weights")
    axes.plot([], [], "s", color="black", ms=3.2, label="draws by MCMC")
    axes.set_ylim(min(0.0, *(panel.result.k_hat for panel in panels)) - 0.1, TOP_K_HAT)
    axes.set_ylabel("k-hat")


def _draw_efficiencies(axes: Axes, panels: Sequence[ExactPanel]) -> None:
    for position, panel in enumerate(panels, start=1):
        marker = "s" if panel.result.by_mcmc else "o"
        axes.plot(position, 100.0 * panel.result.efficiency, marker, color="black", ms=3.2)
    axes.set_ylim(0.0, 105.0)
    axes.set_yticks([0.0, 50.0, 100.0])
    axes.set_ylabel("efficiency\n(%)")


def _shade(axes: Axes, panels: Sequence[ExactPanel]) -> None:
    """Grey the column of every contradicted subject."""
    for position, panel in enumerate(panels, start=1):
        if panel.verdict.status == Status.CONTRADICTED:
            axes.axvspan(position - 0.5, position + 0.5, color=EXCLUDED_BACKGROUND, lw=0, zorder=0)


def _name_subjects(axes: Axes, panels: Sequence[ExactPanel]) -> None:
    """Name the subjects below their columns; long names stand upright, so that neighbours do not touch."""
    rotation = 90.0 if max(len(panel.subject) for panel in panels) > LONGEST_LEVEL_NAME else 0.0
    names = ["prior", *(panel.subject for panel in panels)]
    axes.set_xticks(range(len(names)), names, rotation=rotation)
    axes.set_xlim(-0.6, len(panels) + 0.6)
