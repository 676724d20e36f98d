"""Densities of a parameter, and the parts of a corner plot made of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.stats import gaussian_kde, norm

from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_LABELS, PHI_SYMBOLS
from swesbi.prior import ParameterPrior
from swesbi.report.figures.style import EXCLUDED_BACKGROUND, PRIOR
from swesbi.report.numbers import digits

FloatArray = NDArray[np.float64]
POINTS = 256
SYMBOLS: Final = tuple(PHI_SYMBOLS.values())
SHOWN_DRAWS: Final = 2000
RANGE_QUANTILES: Final = (0.002, 0.998)
DENSITY_QUANTILES: Final = (0.0005, 0.9995)
MARGIN: Final = 0.06
FARTHEST: Final = 1.0
GRID_POINTS: Final = 50
EXCLUDED_COLOR: Final = "#6E6E6E"


def log_density_of_draws(draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return theta and the density per unit of log theta, from draws (n,) by a Gaussian kernel.

    The support ends at the extreme draws. Draws that are all equal give one point of density 1.
    """
    if np.ptp(draws) == 0.0:
        return draws[:1], np.ones(1)
    log_theta = np.log(draws)
    at = np.linspace(log_theta.min(), log_theta.max(), POINTS)
    return np.exp(at), gaussian_kde(log_theta)(at)


def log_density_of_prior(prior: ParameterPrior) -> tuple[FloatArray, FloatArray]:
    """Return theta from bound to bound and the prior's density per unit of log theta."""
    at = np.linspace(np.log(prior.low), np.log(prior.high), POINTS)
    standard = norm(np.log(prior.centre), prior.log_sd)
    mass = standard.cdf(np.log(prior.high)) - standard.cdf(np.log(prior.low))
    return np.exp(at), standard.pdf(at) / mass


def shown_range(draws: FloatArray, points: Sequence[float]) -> tuple[float, float]:
    """Return the range of nearly all draws, widened to each point unless that would dwarf them."""
    low, high = map(float, np.quantile(draws, RANGE_QUANTILES))
    reach = FARTHEST * (high - low)
    near = [point for point in points if low - reach <= point <= high + reach]
    low, high = min([low, *near]), max([high, *near])
    margin = MARGIN * (high - low) or MARGIN * abs(high)
    return low - margin, high + margin


def draw_point(axes: Axes, point: tuple[float, float], color: str, marker: str = "x") -> None:
    """Draw a reference point; beyond the axes as a triangle on their edge, pointing to it."""
    edges = (axes.get_xlim(), axes.get_ylim())
    inside = tuple(min(max(value, edge[0]), edge[1]) for value, edge in zip(point, edges, strict=True))
    if inside[0] != point[0]:
        marker = ">" if point[0] > inside[0] else "<"
    elif inside[1] != point[1]:
        marker = "^" if point[1] > inside[1] else "v"
    axes.plot(*inside, marker, color=color, ms=5.0, mew=1.3, clip_on=False, zorder=5)


def draw_marginal(axes: Axes, draws: FloatArray, prior: ParameterPrior, color: str, interval: float) -> None:
    """Draw a marginal and the prior, each scaled to its maximum, with median and credible interval."""
    theta, per_log = log_density_of_prior(prior)
    density = per_log / theta
    axes.fill_between(theta, density / density.max(), color=PRIOR, alpha=0.3, lw=0)
    draw_density(axes, draws, color=color)
    low, median, high = map(float, median_and_interval(draws, interval))
    axes.axvline(median, color="black", lw=0.8)
    for end in (low, high):
        axes.axvline(end, color="black", lw=0.7, ls=(0, (3, 2)))
    axes.set_ylim(0.0, 1.08)
    axes.set_title(f"{digits(median)} [{digits(low)}, {digits(high)}]", fontsize=6.5, loc="center")


def draw_density(axes: Axes, draws: FloatArray, **look: Any) -> None:  # noqa: ANN401
    """Draw the density of draws by a Gaussian kernel, scaled to its maximum; nothing if all are equal."""
    if np.ptp(draws) > 0.0:
        at = _span(draws, 4 * GRID_POINTS)
        values = gaussian_kde(draws)(at)
        axes.plot(at, values / values.max(), **look)


def draw_pair(axes: Axes, x: FloatArray, y: FloatArray, color: str, interval: float) -> None:
    """Draw two parameters against each other, with the regions of half the mass and of the interval's."""
    axes.plot(x[:SHOWN_DRAWS], y[:SHOWN_DRAWS], ".", color=color, ms=1.5, alpha=0.25, mew=0, rasterized=True)
    draw_contours(axes, x, y, (1.0 - interval, 0.5), colors="black", linewidths=0.7)


def draw_contours(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    outside: Sequence[float],
    **look: Any,  # noqa: ANN401
) -> None:
    """Draw highest-density regions by a Gaussian kernel, each leaving so much of the mass outside."""
    x, y = x[:SHOWN_DRAWS], y[:SHOWN_DRAWS]
    if len(x) <= 10 or not abs(np.corrcoef(x, y)[0, 1]) < 1.0:
        return
    mesh = np.meshgrid(_span(x, GRID_POINTS), _span(y, GRID_POINTS))
    density = gaussian_kde(np.stack([x, y]))(np.stack([mesh[0].ravel(), mesh[1].ravel()]))
    # the mass below each density, on the grid
    ordered = np.sort(density)
    below = np.cumsum(ordered) / ordered.sum()
    levels = ordered[np.searchsorted(below, outside)]
    axes.contour(*mesh, density.reshape(mesh[0].shape), levels=levels, **look)


def write_correlation(axes: Axes, x: FloatArray, y: FloatArray, pair: tuple[int, int]) -> None:
    """Write the correlation of two parameters into an empty panel."""
    r = np.corrcoef(x, y)[0, 1]
    text = f"$r$({SYMBOLS[pair[0]]}, {SYMBOLS[pair[1]]})\n= {r:.2f}".replace("-", "−")
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=8.0)


def draw_bounds(axes: Axes, prior: ParameterPrior, limits: tuple[float, float]) -> None:
    """Draw those bounds of the horizontal parameter that are in view."""
    for bound in (prior.low, prior.high):
        if limits[0] < bound < limits[1]:
            axes.axvline(bound, color=PRIOR, lw=0.9, ls=":", zorder=0.5)


def finish(axes: Axes, row: int, column: int, limits: tuple[float, float], last_row: int) -> None:
    """Labels and ticks at the left and the bottom only; the upper triangle holds text."""
    if column > row:
        axes.set_axis_off()
        return
    axes.set_xlim(limits)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    if row == last_row:
        axes.set_xlabel(PHI_LABELS[column])
    else:
        axes.tick_params(labelbottom=False)
    if column == row:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        return
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if column == 0:
        axes.set_ylabel(PHI_LABELS[row])
    else:
        axes.tick_params(labelleft=False)


def mark_excluded(grid: NDArray[np.object_]) -> None:
    """Grey every panel of the lower triangle."""
    for (row, column), axes in np.ndenumerate(grid):
        if column <= row:
            axes.set_facecolor(EXCLUDED_BACKGROUND)


def _span(draws: FloatArray, points: int) -> FloatArray:
    """Return evenly spaced values across all but the extreme draws."""
    low, high = np.quantile(draws, DENSITY_QUANTILES)
    return np.linspace(float(low), float(high), points)
