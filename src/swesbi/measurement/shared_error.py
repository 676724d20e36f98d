"""Normal data of which each has an error of its own and some share others: phases, and pushes in cells.

What p phases share is W n with n ~ N(0, 1) of R components: their covariance is C = diag(s^2) + W W^T.
Each datum given those before it is normal, and what those tell of n is carried along: with m and P its mean
and covariance given them, at first 0 and 1,

    v_i = s_i^2 + w_i^T P w_i,   z_i = (d_i - w_i^T m) / sqrt(v_i),   m += P w_i z_i / sqrt(v_i),
    P -= P w_i w_i^T P / v_i,

the Kalman filter of a state that stays (Durbin and Koopman, Time Series Analysis by State Space Methods,
2012, Sec. 4.3). The z are L^-1 d, L being the Cholesky factor of C in the order of the data, and det C is the
product of the v. No matrix is larger than R x R, and any number of rows is done at once.

Pushes lie at instants s_i, several of them as near to one another as one likes, so what the model misses is
not drawn anew for each. It is one in a cell of the cycle, as it is one at a gated phase: with log c(s) the
noiseless log speed, a push i in the cell b has

    log c_i = log c(s_i) + delta n_b + tau (d log c / ds)(s_i) m_b + lambda e_i,   n_b, m_b ~ N(0, 1),

and e_i ~ N(0, se_i^2) of its own, so that pushes of a cell have the covariance

    lambda^2 diag(se^2) + delta^2 1 1^T + tau^2 f f^T,   f_i = (d log c / ds)(s_i),

and those of different cells none. With one push a cell that is the variance of a gated phase
(``likelihood.log_speed_sd``). Nothing is averaged: of pushes of one instant and of equal, known errors the
mean of log c is sufficient, so that their likelihood is that of the mean in all but a factor without phi.

Where the errors are declared and not known, lambda is one factor of all of them with log lambda ~ N(0, v^2),
and the likelihood is the integral over it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray, IntArray


def normal_log_density(z: FloatArray, log_sd: FloatArray) -> FloatArray:
    """Return the normal log density of data whose standardised residuals are z; of the data's shape."""
    return np.asarray(-0.5 * z**2 - log_sd - 0.5 * np.log(2.0 * np.pi))


@dataclass(frozen=True)
class Errors:
    """Errors of n rows of p data with the covariance diag(s^2) + W W^T; s is (n, p), W of all rows (p, R)."""

    sd: FloatArray
    shared: FloatArray

    def times(self, factor: float) -> Errors:
        """Return the same errors times a factor."""
        return Errors(factor * self.sd, factor * self.shared)

    def solve(self, values: FloatArray) -> FloatArray:
        """Return C^-1 B of values B (n, p, k) by Woodbury's identity, without C^-1; shape (n, p, k)."""
        own = self.sd[:, :, None] ** -2.0
        weighed, by_own = own * self.shared, own * values
        small = np.eye(self.shared.shape[1]) + self.shared.T @ weighed
        return np.asarray(by_own - weighed @ np.linalg.solve(small, self.shared.T @ by_own))


@dataclass(frozen=True)
class Innovations:
    """n rows of p data, each datum given those before it in its row; shapes (n, p).

    z are independent standard normals where C is the covariance, sd the conditional standard deviations.
    """

    z: FloatArray
    sd: FloatArray

    @property
    def log_density(self) -> FloatArray:
        """Joint log density of the p data of each row, log N(d; 0, C); shape (n,)."""
        return np.asarray(normal_log_density(self.z, np.log(self.sd)).sum(axis=1))

    @property
    def chi_squared(self) -> FloatArray:
        """d^T C^-1 d of each row; shape (n,)."""
        return np.asarray((self.z**2).sum(axis=1))


def innovations(distance: FloatArray, sd: FloatArray, shared: FloatArray) -> Innovations:
    """Standardise n rows of data less their means (n, p), each datum given those before it.

    A row with NaN stays NaN from there on.
    """
    if not shared.shape[1]:
        return Innovations(np.asarray(distance / sd), sd)
    z, conditional = np.empty_like(distance), np.empty_like(distance)
    mean = np.zeros((len(distance), shared.shape[1]))
    covariance = np.tile(np.eye(shared.shape[1]), (len(distance), 1, 1))
    for i, row in enumerate(shared):
        gain = covariance @ row
        conditional[:, i] = np.sqrt(sd[:, i] ** 2 + gain @ row)
        gain /= conditional[:, i, None]
        z[:, i] = (distance[:, i] - mean @ row) / conditional[:, i]
        mean += gain * z[:, i, None]
        covariance -= gain[:, :, None] * gain[:, None, :]
    return Innovations(z, conditional)


def draw_shared(shared: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Draw W n of ``count`` rows, each with n of its own; shape (count, p).

    W is that of all rows (p, R) or of each (count, p, R); with R = 0 nothing is drawn.
    """
    normal = rng.standard_normal((count, shared.shape[-1]))
    return np.asarray(np.einsum("...pr,...r->...p", shared, normal))


WIDEST_STEP: Final = 0.25
NEWTON_STEPS: Final = 8
REACH: Final = 6.0  # standard deviations of log lambda to either side


@dataclass(frozen=True)
class CellData:
    """n rows of p data about their means, and what makes their errors in c cells.

    Distances and slopes d log c / ds are (n, p). Own errors and the cell of each datum are (p,); the data of
    one cell lie side by side. The fraction is delta, the timing tau.
    """

    distance: FloatArray
    slope: FloatArray
    se: FloatArray
    cell: IntArray
    speed_fraction: float
    timing_cycle: float


def cell_innovations(data: CellData) -> Innovations:
    """Standardise the data, each datum given those before it in its row.

    The filter of :func:`innovations`, with a state of two components (n_b, m_b) that begins anew in each
    cell and loadings (delta, tau f_i) that differ from row to row.
    """
    z, sd = np.empty_like(data.distance), np.empty_like(data.distance)
    first, rows = np.diff(data.cell, prepend=-1) != 0, len(data.distance)
    level = data.speed_fraction
    for i in range(len(data.cell)):
        if first[i]:
            mean_n, mean_m, cross = (np.zeros(rows) for _ in range(3))
            var_n, var_m = np.ones(rows), np.ones(rows)
        timing = data.timing_cycle * data.slope[:, i]
        gain_n, gain_m = var_n * level + cross * timing, cross * level + var_m * timing
        sd[:, i] = np.sqrt(data.se[i] ** 2 + level * gain_n + timing * gain_m)
        z[:, i] = (data.distance[:, i] - level * mean_n - timing * mean_m) / sd[:, i]
        gain_n, gain_m = gain_n / sd[:, i], gain_m / sd[:, i]
        mean_n, mean_m = mean_n + gain_n * z[:, i], mean_m + gain_m * z[:, i]
        var_n, var_m, cross = var_n - gain_n**2, var_m - gain_m**2, cross - gain_n * gain_m
    return Innovations(z, sd)


@dataclass(frozen=True)
class CellSums:
    """What n rows of p data are to the normal density of c cells, whatever the factor of the own errors.

    With D = diag(se^2), U = (delta 1, tau f) and distances d of the data of a cell, its covariance is
    C = lambda^2 D + U U^T, and with A = U^T D^-1 U, b = U^T D^-1 d (Woodbury)

        d^T C^-1 d = (d^T D^-1 d - b^T (lambda^2 + A)^-1 b) / lambda^2,
        det C = lambda^(2 p) det D det(1 + A / lambda^2).

    The entries of A are ``level`` (c,), ``cross`` and ``timing`` (n, c); those of b ``by_level`` and
    ``by_timing`` (n, c). ``squares`` is d^T D^-1 d over all cells (n,), ``log_det`` log det D.
    """

    level: FloatArray
    cross: FloatArray
    timing: FloatArray
    by_level: FloatArray
    by_timing: FloatArray
    squares: FloatArray
    log_det: float
    data: int

    def chi_squared(self, factor: FloatArray | float = 1.0) -> FloatArray:
        """Return d^T C^-1 d of all cells, errors times a factor of all rows or of each, (n,); shape (n,)."""
        return self._parts(factor)[0]

    def log_density(self, factor: FloatArray | float = 1.0) -> FloatArray:
        """Return log N(d; 0, C) of all cells; shape (n,)."""
        chi_squared, log_det = self._parts(factor)
        return np.asarray(-0.5 * (chi_squared + log_det + self.data * np.log(2.0 * np.pi)))

    def _parts(self, factor: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Return d^T C^-1 d and log det C; (n,) each."""
        square = np.reshape(factor, (-1, 1)) ** 2.0
        level, timing = self.level + square, self.timing + square
        det = level * timing - self.cross**2
        explained = self.by_level**2 * timing + self.by_timing**2 * level
        explained = (explained - 2.0 * self.by_level * self.by_timing * self.cross) / det
        log_square = np.log(square)
        chi_squared = (self.squares - explained.sum(axis=1)) / square[:, 0]
        log_det = self.log_det + self.data * log_square[:, 0] + (np.log(det) - 2.0 * log_square).sum(axis=1)
        return np.asarray(chi_squared), np.asarray(log_det)


def cell_sums(data: CellData) -> CellSums:
    """Return what the data are to their density, whatever the factor of the own errors."""
    weight, (level, timing) = data.se**-2.0, (data.speed_fraction, data.timing_cycle)
    by_distance, by_slope = weight * data.distance, weight * data.slope
    return CellSums(
        level=level**2 * over_cells(weight, data.cell),
        cross=level * timing * over_cells(by_slope, data.cell),
        timing=timing**2 * over_cells(by_slope * data.slope, data.cell),
        by_level=level * over_cells(by_distance, data.cell),
        by_timing=timing * over_cells(by_distance * data.slope, data.cell),
        squares=(by_distance * data.distance).sum(axis=1),
        log_det=2.0 * float(np.log(data.se).sum()),
        data=len(data.cell),
    )


def over_cells(values: FloatArray, cell: IntArray, axis: int = -1) -> FloatArray:
    """Return the sums of data over each cell, those of one side by side."""
    return np.asarray(np.add.reduceat(values, np.flatnonzero(np.diff(cell, prepend=-1)), axis=axis))


@dataclass(frozen=True)
class CellErrors:
    """Errors of n rows of p data with the covariance diag(s^2) + delta^2 1 1^T in each cell.

    s is (n, p), the cell of each datum (p,), those of one side by side.
    """

    sd: FloatArray
    cell: IntArray
    speed_fraction: float

    def times(self, factor: float) -> CellErrors:
        """Return the same errors times a factor."""
        return CellErrors(factor * self.sd, self.cell, factor * self.speed_fraction)

    def solve(self, values: FloatArray) -> FloatArray:
        """Return C^-1 B of values B (n, p, k) by Woodbury's identity; shape (n, p, k)."""
        own = self.sd**-2.0
        by_own = own[:, :, None] * values
        share = self.speed_fraction**2 / (1.0 + self.speed_fraction**2 * over_cells(own, self.cell))
        shared = share[:, :, None] * over_cells(by_own, self.cell, axis=1)
        _, place = np.unique(self.cell, return_inverse=True)
        return np.asarray(by_own - own[:, :, None] * shared[:, place])


def error_factors(log_sd: float, pushes: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes lambda_k and log weights of the integral over lambda; (k,) each, one where it is known.

    The trapezium rule in u = log lambda / v over +-6. Of a normal density of standard deviation s it is off
    by 2 exp(-2 pi^2 s^2 / h^2) with steps of h (Trefethen and Weideman 2014, SIAM Review 56:385), 5e-9 with
    h = s. The information of p speeds on log lambda is 2 p at most, so s^2 >= 1 / (1 + 2 p v^2).
    """
    if log_sd == 0.0:
        return np.ones(1), np.zeros(1)
    step = min(WIDEST_STEP, 1.0 / np.sqrt(1.0 + 2.0 * pushes * log_sd**2))
    half = int(np.ceil(REACH / step))
    u = np.linspace(-REACH, REACH, 2 * half + 1)
    log_weight = -0.5 * u**2
    return np.exp(log_sd * u), log_weight - logsumexp(log_weight)


def likeliest_factor(chi_squared: FloatArray, pushes: int, log_sd: float) -> FloatArray:
    """Return the likeliest factor lambda of all errors, as if nothing else made them; shape (n,).

    It is where p u + chi^2 exp(-2 u) / 2 + u^2 / (2 v^2) is least, u = log lambda, by Newton's steps. The
    slope is concave in u, so they go to its root from below. chi^2 is that at a factor of one.
    """
    u = np.zeros(len(chi_squared))
    if log_sd == 0.0:
        return np.ones_like(u)
    for _ in range(NEWTON_STEPS):
        misfit = chi_squared * np.exp(-2.0 * u)
        u = np.minimum(u - (pushes - misfit + u / log_sd**2) / (2.0 * misfit + log_sd**-2), REACH * log_sd)
    return np.asarray(np.exp(u))
