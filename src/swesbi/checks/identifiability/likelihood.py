"""Normal data whose mean and spread both depend on the parameters, and maximising their likelihood.

For y ~ N(m(x), C(x)), C = diag(s(x)^2) + W W^T, with Q = C^-1, q = Q (y - m) and l_i = log s_i, the score
and the expected information are

    d log L / dx_j = sum_i q_i dm_i/dx_j + s_i^2 (q_i^2 - Q_ii) dl_i/dx_j
    I_jk = sum_il Q_il dm_i/dx_j dm_l/dx_k + 2 Q_il^2 s_i^2 s_l^2 dl_i/dx_j dl_l/dx_k

(Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, Eqs. 3.31 and 3C.5). The second
terms are what the spread of the data tells beside their mean. Where nothing is shared, Q is diag(1 / s^2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.measurement.shared_error import innovations, normal_log_density, precision

MAXIMUM_ROUNDS: Final = 60
TOLERANCE: Final = 1e-4  # of the log likelihood; likelihood-ratio levels differ by more than 0.2
FIRST_DAMPING: Final = 1e-2
GREATEST_DAMPING: Final = 1e8
EASE: Final = 0.2
HARDEN: Final = 5.0


@dataclass(frozen=True)
class Moments:
    """What p normal data are expected to be at n parameters; NaN where undefined.

    Attributes:
        mean: Means m; (n, p).
        log_sd: Log standard deviations of their own errors, log s; (n, p).
        shared: Factor W of the errors that they share; (p, R), R = 0 where they are independent.
    """

    mean: FloatArray
    log_sd: FloatArray
    shared: FloatArray

    @property
    def independent(self) -> bool:
        """Whether the data share nothing."""
        return not self.shared.shape[1]

    @property
    def precision(self) -> FloatArray:
        """Q at every parameter; (n, p, p)."""
        return precision(np.exp(self.log_sd), self.shared)


MomentFunction = Callable[[FloatArray], Moments]


@dataclass(frozen=True)
class MomentDerivatives:
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
) -> MomentDerivatives:
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
    return MomentDerivatives(
        Moments(mean[0], log_sd[0], moments.shared),
        central_difference(mean, step),
        central_difference(log_sd, step),
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
    """Return log p(y_i | the other data, x) of every datum, (n, p); of independent ones, log p(y_i | x).

    Given the others, y_i is normal with variance 1 / Q_ii and mean y_i - q_i / Q_ii (Rue and Held, Gaussian
    Markov Random Fields, 2005, Theorem 2.3). Terms of data that share errors do not add up to log p(y | x).
    """
    if moments.independent:
        z = (observed - moments.mean) * np.exp(-moments.log_sd)
        return normal_log_density(z, moments.log_sd)
    whole = moments.precision
    own = np.diagonal(whole, axis1=1, axis2=2)
    z = np.einsum("npq,nq->np", whole, observed - moments.mean) / np.sqrt(own)
    return normal_log_density(z, -0.5 * np.log(own))


def log_likelihood(moments: Moments, observed: FloatArray) -> FloatArray:
    """Return log p(y | x) of all data, (n,)."""
    if moments.independent:
        return np.asarray(log_likelihood_terms(moments, observed).sum(axis=1))
    return innovations(observed - moments.mean, np.exp(moments.log_sd), moments.shared).log_density


def score(at: MomentDerivatives, observed: FloatArray) -> FloatArray:
    """Return the gradient of the log likelihood, (n, f)."""
    distance = observed - at.moments.mean
    if at.moments.independent:
        inverse_sd = np.exp(-at.moments.log_sd)
        z = distance * inverse_sd
        pull, by_spread = z * inverse_sd, z**2 - 1.0
    else:
        whole = at.moments.precision
        pull = np.einsum("npq,nq->np", whole, distance)
        by_spread = np.exp(2.0 * at.moments.log_sd) * (pull**2 - np.diagonal(whole, axis1=1, axis2=2))
    by_mean = np.einsum("np,njp->nj", pull, at.mean_by)
    return np.asarray(by_mean + np.einsum("np,njp->nj", by_spread, at.log_sd_by))


def expected_information(at: MomentDerivatives) -> FloatArray:
    """Return the expected information of all data, (n, f, f)."""
    if at.moments.independent:
        return np.asarray(information_by_datum(at).sum(axis=1))
    whole, spread = at.moments.precision, _spread_by(at)
    from_mean = at.mean_by @ whole @ np.swapaxes(at.mean_by, 1, 2)
    return np.asarray(from_mean + 2.0 * spread @ whole**2 @ np.swapaxes(spread, 1, 2))


def information_by_datum(at: MomentDerivatives) -> FloatArray:
    """Return what each datum adds to the expected information of the others, (n, p, f, f).

    What independent data add is the information of all. Without datum i, the precision of the others is
    Q - Q_.i Q_i. / Q_ii (Rue and Held, Gaussian Markov Random Fields, 2005, Sec. 2.2).
    """
    if not at.moments.independent:
        return _added_by_datum(at)
    mean_by = at.mean_by * np.exp(-at.moments.log_sd)[:, None]
    from_mean = np.einsum("njp,nkp->npjk", mean_by, mean_by)
    return np.asarray(from_mean + 2.0 * np.einsum("njp,nkp->npjk", at.log_sd_by, at.log_sd_by))


def _added_by_datum(at: MomentDerivatives) -> FloatArray:
    whole, spread = at.moments.precision, _spread_by(at)
    own = np.diagonal(whole, axis1=1, axis2=2)
    pull = at.mean_by @ whole / np.sqrt(own)[:, None]
    lost = whole[:, :, :, None] * whole[:, :, None, :] / own[:, :, None, None]
    squares = whole[:, None] ** 2 - (whole[:, None] - lost) ** 2
    from_spread = spread[:, None] @ squares @ np.swapaxes(spread, 1, 2)[:, None]
    return np.asarray(np.einsum("njp,nkp->npjk", pull, pull) + 2.0 * from_spread)


def _spread_by(at: MomentDerivatives) -> FloatArray:
    """Return s^2 d log s / d x_j, half the change of C's diagonal; (n, f, p)."""
    return np.asarray(at.log_sd_by * np.exp(2.0 * at.moments.log_sd)[:, None])


@dataclass(frozen=True)
class NormalProblem:
    """Normal data and the box in which their parameters are searched.

    Attributes:
        moments: Parameters (n, k) to the moments of the data.
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
        total = log_likelihood(self.moments(x), self.observed)
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
            information[stale] = np.nan_to_num(expected_information(at))
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
