"""Normal data whose mean and spread both depend on the parameters, and maximising their likelihood.

For y_i ~ N(m_i(x), s_i(x)^2), with z_i = (y_i - m_i) / s_i, the score and the expected information are

    d log L / dx_j = sum_i z_i / s_i  dm_i/dx_j + (z_i^2 - 1) d log s_i / dx_j
    I_jk = sum_i 1 / s_i^2  dm_i/dx_j dm_i/dx_k + 2  d log s_i / dx_j  d log s_i / dx_k

(Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, Eq. 3.31, for a diagonal
covariance). The second terms are what the spread of the data tells beside their mean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.measurement.likelihood import normal_log_density

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
MAXIMUM_ROUNDS: Final = 60
TOLERANCE: Final = 1e-4  # of the log likelihood; likelihood-ratio levels differ by more than 0.2
FIRST_DAMPING: Final = 1e-2
GREATEST_DAMPING: Final = 1e8
EASE: Final = 0.2
HARDEN: Final = 5.0


@dataclass(frozen=True)
class Moments:
    """Mean and log standard deviation of p data at n parameters; (n, p) each, NaN where undefined."""

    mean: FloatArray
    log_sd: FloatArray


MomentFunction = Callable[[FloatArray], Moments]


@dataclass(frozen=True)
class Differentiated:
    """Moments at n parameters with their derivatives along f coordinates.

    Attributes:
        moments: (n, p).
        mean_by: d mean / d x_j; (n, f, p).
        log_sd_by: d log sd / d x_j; (n, f, p).
    """

    moments: Moments
    mean_by: FloatArray
    log_sd_by: FloatArray


def differentiate(
    function: MomentFunction, x: FloatArray, step: float, along: Sequence[int] | None = None
) -> Differentiated:
    """Differentiate by central differences, all points in one call of ``function``.

    Args:
        function: Parameters (m, k) to moments (m, p).
        x: Where; (n, k).
        step: Half the distance of the two points of a difference.
        along: Coordinates to differentiate along; all by default.
    """
    coordinates = range(x.shape[1]) if along is None else along
    moments = function(stencil(x, step, coordinates).reshape(-1, x.shape[1]))
    mean, log_sd = (
        values.reshape(-1, *x.shape[:1], values.shape[1]) for values in (moments.mean, moments.log_sd)
    )
    return Differentiated(
        Moments(mean[0], log_sd[0]), central_difference(mean, step), central_difference(log_sd, step)
    )


def stencil(x: FloatArray, step: float, along: Sequence[int]) -> FloatArray:
    """Return x itself, then x moved forth and back along each coordinate; (1 + 2 f, n, k) for x (n, k)."""
    points = np.repeat(x[None], 1 + 2 * len(along), axis=0)
    for place, coordinate in enumerate(along):
        points[1 + 2 * place, :, coordinate] += step
        points[2 + 2 * place, :, coordinate] -= step
    return points


def central_difference(values: FloatArray, step: float) -> FloatArray:
    """Return the derivatives (n, f, p) from values (1 + 2 f, n, p) at the points of :func:`stencil`."""
    return np.asarray(np.moveaxis((values[1::2] - values[2::2]) / (2.0 * step), 0, 1))


def log_likelihood_terms(moments: Moments, observed: FloatArray) -> FloatArray:
    """Return log p(y_i | x) of every datum, (n, p)."""
    z = (observed - moments.mean) * np.exp(-moments.log_sd)
    return normal_log_density(z, moments.log_sd)


def score(at: Differentiated, observed: FloatArray) -> FloatArray:
    """Return the gradient of the log likelihood, (n, f)."""
    inverse_sd = np.exp(-at.moments.log_sd)
    z = (observed - at.moments.mean) * inverse_sd
    by_mean = np.einsum("np,njp->nj", z * inverse_sd, at.mean_by)
    return np.asarray(by_mean + np.einsum("np,njp->nj", z**2 - 1.0, at.log_sd_by))


def information_by_datum(at: Differentiated) -> FloatArray:
    """Return each datum's part of the expected information, (n, p, f, f)."""
    mean_by = at.mean_by * np.exp(-at.moments.log_sd)[:, None]
    from_mean = np.einsum("njp,nkp->npjk", mean_by, mean_by)
    return np.asarray(from_mean + 2.0 * np.einsum("njp,nkp->npjk", at.log_sd_by, at.log_sd_by))


@dataclass(frozen=True)
class NormalProblem:
    """Normal data and the box in which their parameters are searched.

    Attributes:
        moments: Parameters (n, k) to mean and log sd of the data.
        observed: The data; (p,).
        low: Lower bounds of the search; (k,).
        high: Upper bounds; (k,).
        step: Step of the differences.
    """

    moments: MomentFunction
    observed: FloatArray
    low: FloatArray
    high: FloatArray
    step: float

    def log_likelihood(self, x: FloatArray) -> FloatArray:
        """Return log L of parameters (n, k), shape (n,); -inf where the moments are undefined."""
        total = log_likelihood_terms(self.moments(x), self.observed).sum(axis=1)
        return np.where(np.isnan(total), -np.inf, total)


@dataclass(frozen=True)
class Maxima:
    """Where n searches ended: x (n, k), log L (n,), and whether no further gain was in sight (n,)."""

    x: FloatArray
    log_likelihood: FloatArray
    converged: BoolArray

    @property
    def best(self) -> int:
        """The row of the highest likelihood."""
        return int(np.argmax(self.log_likelihood))


def maximise(problem: NormalProblem, start: FloatArray, free: Sequence[int]) -> Maxima:
    """Climb from every row of ``start`` (n, k) along the ``free`` coordinates, the others held.

    Fisher scoring with Levenberg's and Marquardt's damping: a step solves (I + damping diag I) d = score
    and counts only if the likelihood rises, so the result is never below the start. A coordinate on its
    bound whose score points outward rests. A search ends where the step, were it not damped, promises less
    than ``TOLERANCE``.
    """
    x = np.clip(start, problem.low, problem.high)
    value = problem.log_likelihood(x)
    damping = np.full(len(x), FIRST_DAMPING)
    done = ~np.isfinite(value)
    gradient, information = np.zeros((len(x), len(free))), np.zeros((len(x), len(free), len(free)))
    stale = ~done
    for _ in range(MAXIMUM_ROUNDS):
        if stale.any():
            at = differentiate(problem.moments, x[stale], problem.step, free)
            gradient[stale] = np.nan_to_num(score(at, problem.observed))
            information[stale] = np.nan_to_num(information_by_datum(at).sum(axis=1))
        rows = np.flatnonzero(~done)
        trial, promise = _step(problem, x[rows], gradient[rows], information[rows], damping[rows], free)
        done[rows] = (promise * (1.0 + damping[rows]) < TOLERANCE) | (damping[rows] > GREATEST_DAMPING)
        rows, trial = rows[~done[rows]], trial[~done[rows]]
        if not rows.size:
            break
        reached = problem.log_likelihood(trial)
        better = reached > value[rows]
        x[rows[better]], value[rows[better]] = trial[better], reached[better]
        damping[rows] *= np.where(better, EASE, HARDEN)
        stale = np.zeros_like(done)
        stale[rows[better]] = True
    return Maxima(x, value, done & np.isfinite(value))


def _step(
    problem: NormalProblem,
    x: FloatArray,
    gradient: FloatArray,
    information: FloatArray,
    damping: FloatArray,
    free: Sequence[int],
) -> tuple[FloatArray, FloatArray]:
    """Return where the damped steps lead, inside the box, and the gain that they promise."""
    columns = list(free)
    low, high = problem.low[columns], problem.high[columns]
    resting = ((x[:, columns] <= low) & (gradient < 0)) | ((x[:, columns] >= high) & (gradient > 0))
    slope = np.where(resting, 0.0, gradient)
    matrix = np.where(resting[:, :, None] | resting[:, None, :], 0.0, information)
    diagonal = np.diagonal(matrix, axis1=1, axis2=2)
    extra = damping[:, None] * diagonal + np.where(diagonal > 0.0, 0.0, 1.0)
    direction = np.linalg.solve(matrix + extra[:, :, None] * np.eye(len(columns)), slope[:, :, None])[:, :, 0]
    trial = x.copy()
    trial[:, columns] = np.clip(x[:, columns] + direction, low, high)
    return trial, np.einsum("nj,nj->n", slope, trial[:, columns] - x[:, columns])
