"""Densities of a parameter, and the parts of a corner plot made of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from scipy.stats import gaussian_kde, norm

from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_LABELS, ParameterPrior
from swesbi.prior import JointPriorSettings, PriorSettings, quantile
from swesbi.report.figures.style import OBSERVED, PRIOR, few_ticks
from swesbi.report.numbers import as_percent, digits

POINTS: Final = 256
SHOWN_DRAWS: Final = 2000
RANGE_QUANTILES: Final = (0.002, 0.998)
DENSITY_QUANTILES: Final = (0.0005, 0.9995)
PRIOR_TAIL: Final = 0.05
MARGIN: Final = 0.06
GRID_POINTS: Final = 50


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


def prior_band(prior: PriorSettings | JointPriorSettings) -> FloatArray:
    """Return the prior's central 90 % of each of its d parameters; shape (2, d)."""
    levels = np.repeat([[PRIOR_TAIL], [1.0 - PRIOR_TAIL]], len(prior.parameters), axis=1)
    return quantile(levels, prior)


def shown_range(draws: FloatArray, points: Sequence[float]) -> tuple[float, float]:
    """Return the range of nearly all draws, widened to each point unless that would dwarf them."""
    low, high = map(float, np.quantile(draws, RANGE_QUANTILES))
    reach = high - low
    near = [point for point in points if low - reach <= point <= high + reach]
    low, high = min([low, *near]), max([high, *near])
    margin = MARGIN * (high - low) or MARGIN * abs(high)
    return low - margin, high + margin


def draw_point(axes: Axes, point: tuple[float, float], color: str, marker: str, label: str) -> None:
    """Draw a reference point; beyond the axes as a triangle on their edge, pointing to it."""
    edges = (axes.get_xlim(), axes.get_ylim())
    axes.plot([], [], marker, color=color, ms=5.0, mew=1.3, label=label)
    x, y = (min(max(value, edge[0]), edge[1]) for value, edge in zip(point, edges, strict=True))
    if x != point[0]:
        marker = ">" if point[0] > x else "<"
    elif y != point[1]:
        marker = "^" if point[1] > y else "v"
    axes.plot(x, y, marker, color=color, ms=5.0, mew=1.3, clip_on=False, zorder=5)


def draw_marginal(
    axes: Axes, draws: FloatArray, prior: ParameterPrior, color: str, interval: float, label: str
) -> None:
    """Draw a marginal and the prior, each scaled to its maximum, with median and credible interval."""
    theta, per_log = log_density_of_prior(prior)
    density, mass = per_log / theta, as_percent(interval)
    axes.fill_between(
        theta, density / density.max(), color=PRIOR, alpha=0.3, lw=0, label="prior (dotted: bounds)"
    )
    draw_density(axes, draws, color=color, label=label)
    low, median, high = map(float, median_and_interval(draws, interval))
    axes.axvline(median, color=OBSERVED, lw=0.8, label=f"median; 50 % and {mass} regions")
    for end in (low, high):
        axes.axvline(end, color=OBSERVED, lw=0.7, ls=(0, (3, 2)), label=f"{mass} credible interval")
    axes.set_ylim(0.0, 1.08)
    axes.set_title(f"{digits(median)} ({digits(low)} to {digits(high)})", fontsize=6.5, loc="center")


def draw_density(axes: Axes, draws: FloatArray, **look: Any) -> None:  # noqa: ANN401
    """Draw the density of draws by a Gaussian kernel, scaled to its maximum; nothing if all are equal."""
    if np.ptp(draws) > 0.0:
        at = _span(draws, 4 * GRID_POINTS)
        values = gaussian_kde(draws)(at)
        axes.plot(at, values / values.max(), **look)


def draw_pair(axes: Axes, x: FloatArray, y: FloatArray, color: str, interval: float) -> None:
    """Draw two parameters against each other, with the regions of half the mass and of the interval's."""
    axes.plot(x[:SHOWN_DRAWS], y[:SHOWN_DRAWS], ".", color=color, ms=1.5, alpha=0.25, mew=0, rasterized=True)
    draw_contours(axes, x, y, (1.0 - interval, 0.5), colors=OBSERVED, linewidths=0.7)


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
    ordered = np.sort(density)
    mass_below = np.cumsum(ordered) / ordered.sum()
    levels = ordered[np.searchsorted(mass_below, outside)]
    axes.contour(*mesh, density.reshape(mesh[0].shape), levels=levels, **look)


def finish_corner(axes: Axes, place: tuple[int, int], limits: tuple[float, float], last: int) -> None:
    """Give a panel of the lower triangle its limits, with labels at the left and the bottom only."""
    row, column = place
    axes.set(xlim=limits, xlabel=PHI_LABELS[column] if row == last else "")
    axes.xaxis.set_major_locator(few_ticks())
    axes.tick_params(labelbottom=row == last, labelleft=column == 0)
    if column == row:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
    else:
        axes.yaxis.set_major_locator(few_ticks())
        axes.set_ylabel("" if column else PHI_LABELS[row])


def _span(draws: FloatArray, points: int) -> FloatArray:
    """Return evenly spaced values across all but the extreme draws."""
    low, high = np.quantile(draws, DENSITY_QUANTILES)
    return np.linspace(float(low), float(high), points)
