"""One subject's posterior: marginals beside the prior, pairs of parameters, their correlations."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from swesbi.evaluation.support_numbers import support_numbers
from swesbi.figures.density import log_density_of_prior
from swesbi.figures.panels import PosteriorPanel
from swesbi.figures.style import CMAES, EXCLUDED_BACKGROUND, POSTERIOR, PRIOR, new_figure, style
from swesbi.figures.text import digits, percent, titled
from swesbi.simulations.prior import ParameterPrior, PriorSettings
from swesbi.theta import THETA_LABELS

FloatArray = NDArray[np.float64]

SIDE_IN = 5.2
SHOWN_DRAWS = 2000
RANGE_QUANTILES = (0.002, 0.998)
DENSITY_QUANTILES = (0.0005, 0.9995)
MARGIN = 0.06
FARTHEST_FIT = 1.0
GRID_POINTS = 60
EXCLUDED_COLOR = "#6E6E6E"
SYMBOLS = ("$k_0$", r"$k_\mathrm{ATP}$", r"$k_\mathrm{SR}$")


def draw(panel: PosteriorPanel, prior: PriorSettings, interval: float, cohort_title: str) -> Figure:
    """Draw a corner plot of one posterior; of the unfiltered candidates where the subject is excluded.

    Args:
        panel: The subject.
        prior: The prior, drawn behind the marginals, each density scaled to its maximum.
        interval: Probability mass of the credible intervals and of the outer contour.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    draws = panel.theta if panel.support.supported else _finite(panel.unfiltered)
    color = POSTERIOR if panel.support.supported else EXCLUDED_COLOR
    fit = tuple(map(float, panel.fit_theta))
    limits = [_limits(draws[:, j], fit[j]) for j in range(3)]
    with style():
        figure = new_figure(SIDE_IN, SIDE_IN)
        grid = figure.subplots(3, 3)
        for j in range(3):
            _draw_marginal(grid[j, j], draws[:, j], prior.parameters[j], color, interval)
            for i in range(j):
                _draw_pair(grid[j, i], draws[:, i], draws[:, j], color, interval)
                grid[j, i].set_ylim(limits[j])
                _write_correlation(grid[i, j], draws[:, i], draws[:, j], (i, j))
        for (j, i), axes in np.ndenumerate(grid):
            _finish(axes, j, i, limits[i])
            if i <= j:
                _draw_bounds(axes, prior.parameters[i], limits[i])
                _draw_fit(axes, (fit[i], fit[j] if i < j else 0.0))
        if not panel.support.supported:
            _mark_excluded(grid)
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


def _limits(draws: FloatArray, fit: float) -> tuple[float, float]:
    """Return the range of nearly all draws, widened to the reference fit unless that would dwarf them."""
    low, high = map(float, np.quantile(draws, RANGE_QUANTILES))
    reach = FARTHEST_FIT * (high - low)
    if low - reach <= fit <= high + reach:
        low, high = min(low, fit), max(high, fit)
    margin = MARGIN * (high - low) or MARGIN * abs(high)
    return low - margin, high + margin


def _draw_fit(axes: Axes, fit: tuple[float, float]) -> None:
    """Draw the reference fit as a cross; beyond the axes as a triangle on their edge, pointing to it."""
    edges = (axes.get_xlim(), axes.get_ylim())
    inside = tuple(min(max(value, edge[0]), edge[1]) for value, edge in zip(fit, edges, strict=True))
    marker = "x"
    if inside[0] != fit[0]:
        marker = ">" if fit[0] > inside[0] else "<"
    elif inside[1] != fit[1]:
        marker = "^" if fit[1] > inside[1] else "v"
    axes.plot(*inside, marker, color=CMAES, ms=5.0, mew=1.3, clip_on=False, zorder=5)


def _span(draws: FloatArray, points: int) -> FloatArray:
    """Return evenly spaced values across all but the extreme draws."""
    low, high = np.quantile(draws, DENSITY_QUANTILES)
    return np.linspace(float(low), float(high), points)


def _draw_marginal(axes: Axes, draws: FloatArray, prior: ParameterPrior, color: str, interval: float) -> None:
    theta, per_log = log_density_of_prior(prior)
    density = per_log / theta
    axes.fill_between(theta, density / density.max(), color=PRIOR, alpha=0.3, lw=0)
    if np.ptp(draws) > 0.0:
        at = _span(draws, 4 * GRID_POINTS)
        values = gaussian_kde(draws)(at)
        axes.plot(at, values / values.max(), color=color)
    tail = (1.0 - interval) / 2.0
    low, median, high = np.quantile(draws, [tail, 0.5, 1.0 - tail])
    axes.axvline(median, color="black", lw=0.8)
    for end in (low, high):
        axes.axvline(end, color="black", lw=0.7, ls=(0, (3, 2)))
    axes.set_ylim(0.0, 1.08)
    axes.set_title(f"{digits(median)} [{digits(low)}, {digits(high)}]", fontsize=6.5, loc="center")


def _draw_pair(axes: Axes, x: FloatArray, y: FloatArray, color: str, interval: float) -> None:
    axes.plot(x[:SHOWN_DRAWS], y[:SHOWN_DRAWS], ".", color=color, ms=1.5, alpha=0.25, mew=0, rasterized=True)
    if len(x) > 10 and abs(np.corrcoef(x, y)[0, 1]) < 1.0:
        _draw_contours(axes, x[:SHOWN_DRAWS], y[:SHOWN_DRAWS], interval)


def _draw_contours(axes: Axes, x: FloatArray, y: FloatArray, interval: float) -> None:
    """Draw the highest-density regions of half the mass and of the interval's, by a Gaussian kernel."""
    kernel = gaussian_kde(np.stack([x, y]))
    levels = np.quantile(kernel(np.stack([x, y])), [1.0 - interval, 0.5])
    mesh = np.meshgrid(_span(x, GRID_POINTS), _span(y, GRID_POINTS))
    density = kernel(np.stack([mesh[0].ravel(), mesh[1].ravel()])).reshape(mesh[0].shape)
    axes.contour(*mesh, density, levels=levels, colors="black", linewidths=0.7)


def _write_correlation(axes: Axes, x: FloatArray, y: FloatArray, pair: tuple[int, int]) -> None:
    r = np.corrcoef(x, y)[0, 1]
    text = f"$r$({SYMBOLS[pair[0]]}, {SYMBOLS[pair[1]]})\n= {r:.2f}".replace("-", "−")
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=8.0)


def _draw_bounds(axes: Axes, prior: ParameterPrior, limits: tuple[float, float]) -> None:
    """Draw those bounds of the horizontal parameter that are in view."""
    for bound in (prior.low, prior.high):
        if limits[0] < bound < limits[1]:
            axes.axvline(bound, color=PRIOR, lw=0.9, ls=":", zorder=0.5)


def _finish(axes: Axes, row: int, column: int, limits: tuple[float, float]) -> None:
    """Labels and ticks at the left and the bottom only; the upper triangle holds text."""
    if column > row:
        axes.set_axis_off()
        return
    axes.set_xlim(limits)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    if row == 2:
        axes.set_xlabel(THETA_LABELS[column])
    else:
        axes.tick_params(labelbottom=False)
    if column == row:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        return
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if column == 0:
        axes.set_ylabel(THETA_LABELS[row])
    else:
        axes.tick_params(labelleft=False)


def _mark_excluded(grid: NDArray[np.object_]) -> None:
    for (row, column), axes in np.ndenumerate(grid):
        if column <= row:
            axes.set_facecolor(EXCLUDED_BACKGROUND)


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
