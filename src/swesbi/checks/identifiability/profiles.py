"""Profiles of a recording's likelihood: its maximum over the other parameters, along one or two of them.

What is known of nuisance parameters beforehand counts as data (``information.in_logit``).

The region with 2 (log L_max - log L) below the chi-square quantile is the likelihood-ratio confidence
region (Wilks 1938; Pawitan, In All Likelihood, 2001, Secs. 2.6 and 3.4), with as many degrees of freedom
as parameters held. Where the maximum lies on a bound of the box, its level is approximate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated, Final

import numpy as np
from scipy.special import chdtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.identifiability.information import in_logit, maximum_likelihood
from swesbi.checks.identifiability.likelihood import Maxima, NormalProblem, maximise
from swesbi.checks.identifiability.settings import IdentifiabilitySettings
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import K_0, K_ATP, OF_INTEREST, PHI_COLUMNS, PHI_NAMES
from swesbi.prior import JointPriorSettings, bounds, from_logit

CLOSING_ROUNDS: Final = 8
STILL_CLOSING: Final = 0.7
NEIGHBOUR_ROUNDS: Final = 2
PAIR = (K_0, K_ATP)


@dataclass(frozen=True)
class Profile:
    """The likelihood maximised over the other coordinates, on a grid of f held ones with g points each.

    Attributes:
        held: Indices of the held coordinates.
        axes: Their grid values, ascending; f arrays of shape (g,).
        x: All k coordinates at every grid point; (g, ..., g, k).
        log_likelihood: There; (g, ..., g).
    """

    held: tuple[int, ...]
    axes: tuple[FloatArray, ...]
    x: FloatArray
    log_likelihood: FloatArray

    def deviance(self, maximum: float) -> FloatArray:
        """Return 2 (log L_max - log L), (g, ..., g)."""
        return np.asarray(2.0 * (maximum - self.log_likelihood))


def drop(level: float, held: int) -> float:
    """Return the deviance that bounds the region of a confidence level, with ``held`` coordinates."""
    return float(chdtri(held, 1.0 - level))


def profile(
    problem: NormalProblem, held: int, best: FloatArray, coarse_points: int, points: int, level: float
) -> Profile:
    """Profile along one coordinate over the whole box coarsely, then finely over the region that matters.

    Args:
        problem: The likelihood.
        held: The coordinate.
        best: Coordinates of the maximum; (k,).
        coarse_points: Grid points over the box, and over guesses of the region until it no longer shrinks.
        points: Grid points over the region that matters.
        level: Its confidence level with two coordinates held, so that it holds the region of a pair.
    """
    axis = np.linspace(problem.low[held], problem.high[held], coarse_points)
    profiled = on_grid(problem, (held,), (axis,), np.broadcast_to(best, (coarse_points, len(best))))
    for _ in range(CLOSING_ROUNDS):
        axis = _closer(profiled, problem, best, coarse_points, level)
        if np.ptp(axis) > STILL_CLOSING * np.ptp(profiled.axes[0]):
            break
        profiled = on_grid(problem, (held,), (axis,), _along(profiled, axis))
    axis = _closer(profiled, problem, best, points, level)
    return on_grid(problem, (held,), (axis,), _along(profiled, axis))


def pair_profile(problem: NormalProblem, first: Profile, second: Profile, points: int) -> Profile:
    """Profile along two coordinates, over the range of their own profiles, ``points`` along each.

    The projection of the region of two coordinates on one of them is the region of the same deviance in
    the profile of that one, so both ranges together hold it.
    """
    axes = tuple(np.linspace(own.axes[0][0], own.axes[0][-1], points) for own in (first, second))
    start = np.repeat(_along(first, axes[0])[:, None], points, axis=1)
    return on_grid(problem, first.held + second.held, axes, start)


def on_grid(
    problem: NormalProblem, held: Sequence[int], axes: Sequence[FloatArray], start: FloatArray
) -> Profile:
    """Maximise at every grid point from ``start`` (g, ..., g, k), then again from better neighbours."""
    grid, shape = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1), start.shape
    free = [j for j in range(shape[-1]) if j not in held]
    first = _held_at(start, held, grid)
    maxima = maximise(problem, first.reshape(-1, shape[-1]), free)
    for _ in range(NEIGHBOUR_ROUNDS):
        maxima = _from_neighbours(problem, maxima, held, grid, free)
    return Profile(
        tuple(held), tuple(axes), maxima.x.reshape(shape), maxima.log_likelihood.reshape(shape[:-1])
    )


def _closer(
    profiled: Profile, problem: NormalProblem, best: FloatArray, points: int, level: float
) -> FloatArray:
    """Return a finer axis over the region of this level for two coordinates, one cell wider."""
    axis = profiled.axes[0]
    maximum = max(profiled.log_likelihood.max(), float(problem.log_likelihood(best[None])[0]))
    near = np.abs(axis - best[profiled.held[0]]) <= axis[1] - axis[0]
    reached = np.flatnonzero((profiled.deviance(maximum) <= drop(level, 2)) | near)
    return np.linspace(axis[max(reached[0] - 1, 0)], axis[min(reached[-1] + 1, len(axis) - 1)], points)


def _along(profiled: Profile, axis: FloatArray) -> FloatArray:
    """Return the coordinates (g, k) of a one-coordinate profile at other values of it, interpolated."""
    return np.stack([np.interp(axis, profiled.axes[0], column) for column in profiled.x.T], axis=1)


def interval(profiled: Profile, best: FloatArray, maximum: float, level: float) -> tuple[float, float]:
    """Return the ends of the likelihood-ratio interval of a one-coordinate profile.

    Between grid points the root of the deviance, which is piecewise linear for a normal likelihood, is
    interpolated. An end that the profile does not reach is NaN: the region is open there, up to the box.

    Args:
        profiled: The profile.
        best: Coordinates of the maximum; (k,).
        maximum: Its log likelihood.
        level: Confidence level.
    """
    at_best = best[profiled.held[0]]
    place = int(np.searchsorted(profiled.axes[0], at_best))
    axis = np.insert(profiled.axes[0], place, at_best)
    root = np.sqrt(np.maximum(np.insert(profiled.deviance(maximum), place, 0.0), 0.0))
    above = root - np.sqrt(drop(level, 1))
    inside = np.flatnonzero(above <= 0.0)
    return _crossing(axis, above, inside[0], -1), _crossing(axis, above, inside[-1], 1)


def _crossing(axis: FloatArray, above: FloatArray, inside: np.intp, towards: int) -> float:
    outside = int(inside) + towards
    if not 0 <= outside < len(axis):
        return float("nan")
    share = above[inside] / (above[inside] - above[outside])
    return float(axis[inside] + share * (axis[outside] - axis[inside]))


def _held_at(x: FloatArray, held: Sequence[int], grid: FloatArray) -> FloatArray:
    moved = x.copy()
    moved[..., list(held)] = grid
    return moved


def _from_neighbours(
    problem: NormalProblem, maxima: Maxima, held: Sequence[int], grid: FloatArray, free: Sequence[int]
) -> Maxima:
    """Search again from a neighbour's free coordinates wherever they give a higher likelihood."""
    x = maxima.x.reshape(*grid.shape[:-1], -1)
    start, value = maxima.x.copy(), maxima.log_likelihood.copy()
    for axis, shift in product(range(grid.ndim - 1), (-1, 1)):
        candidate = _held_at(np.roll(x, shift, axis=axis), held, grid).reshape(maxima.x.shape)
        reached = problem.log_likelihood(candidate)
        better = reached > value
        start[better], value[better] = candidate[better], reached[better]
    rows = np.flatnonzero(value > maxima.log_likelihood)
    if not rows.size:
        return maxima
    again = maximise(problem, start[rows], free)
    result = replace(maxima, x=maxima.x.copy(), log_likelihood=maxima.log_likelihood.copy())
    result.x[rows], result.log_likelihood[rows] = again.x, again.log_likelihood
    return result


@dataclass(frozen=True)
class Profiles:
    """The profiled likelihood; intervals end at the bound of the prior's box where they are open."""

    maximum_phi: Annotated[
        FloatArray, Variable("parameter", PHI_COLUMNS, "greatest likelihood in the prior's box")
    ]
    log_likelihood: Annotated[float, Variable("", "1", "log likelihood there")]
    value: Annotated[FloatArray, Variable("parameter point", PHI_COLUMNS, "grid of each parameter")]
    deviance: Annotated[
        FloatArray, Variable("parameter point", "1", "2 (log L_max - log L), maximised over the others")
    ]
    interval: Annotated[FloatArray, Variable("parameter bound", PHI_COLUMNS, "likelihood-ratio interval")]
    closed: Annotated[
        BoolArray,
        Variable("parameter bound", "1", "0 where it is open, up to the bound of the prior"),
    ]
    k0_kpa: Annotated[FloatArray, Variable("k0_point", "kPa", "grid of k_0")]
    k_atp_per_s: Annotated[FloatArray, Variable("k_atp_point", "s-1", "grid of k_ATP")]
    pair_deviance: Annotated[FloatArray, Variable("k0_point k_atp_point", "1", "over both")]


def profiles_of(model: SpeedModel, settings: IdentifiabilitySettings, seed: int) -> Profiles:
    """Find the greatest likelihood inside the prior's box, and profile it."""
    grid, prior = settings.profile, model.settings.prior
    problem = in_logit(model, settings.difference_step)
    maxima = maximum_likelihood(model, problem, grid.prior_starts, grid.searches, seed)
    best = maxima.x[maxima.best]
    sizes = (grid.coarse_points, grid.points, max(grid.confidence_levels))
    single = [profile(problem, j, best, *sizes) for j in range(len(PHI_NAMES))]
    pair = pair_profile(problem, single[PAIR[0]], single[PAIR[1]], grid.pair_points)
    # a profile may climb a little above the search, whose steps stop at a tolerance
    highest = max(
        maxima.log_likelihood.max(), *(profiled.log_likelihood.max() for profiled in (*single, pair))
    )
    ends, closed = _intervals(single, best, highest, settings.interval, prior)
    return Profiles(
        maximum_phi=from_logit(best, prior)[OF_INTEREST],
        log_likelihood=float(highest),
        value=np.stack([_phi_of(profiled.axes[0], j, prior) for j, profiled in enumerate(single)]),
        deviance=np.stack([profiled.deviance(highest) for profiled in single]),
        interval=ends,
        closed=closed,
        k0_kpa=_phi_of(pair.axes[0], PAIR[0], prior),
        k_atp_per_s=_phi_of(pair.axes[1], PAIR[1], prior),
        pair_deviance=pair.deviance(highest),
    )


def _intervals(
    single: list[Profile], best: FloatArray, maximum: float, level: float, prior: JointPriorSettings
) -> tuple[FloatArray, BoolArray]:
    crossings = np.array([interval(profiled, best, maximum, level) for profiled in single])
    ends = np.stack([_phi_of(row, j, prior) for j, row in enumerate(crossings)])
    closed = np.isfinite(crossings)
    return np.where(closed, ends, np.column_stack(bounds(prior))[OF_INTEREST]), closed


def _phi_of(eta: FloatArray, parameter: int, prior: JointPriorSettings) -> FloatArray:
    """Return the values of one parameter for its logits."""
    return from_logit(np.repeat(eta[:, None], len(prior.names), axis=1), prior)[:, parameter]
