"""Normal data of which each has an error of its own and all share some: covariance C = diag(s^2) + W W^T.

What p data share is W n with n ~ N(0, 1) of R components. Each datum given those before it is normal, and
what those tell of n is carried along: with m and P its mean and covariance given them, at first 0 and 1,

    v_i = s_i^2 + w_i^T P w_i,   z_i = (d_i - w_i^T m) / sqrt(v_i),   m += P w_i z_i / sqrt(v_i),
    P -= P w_i w_i^T P / v_i,

the Kalman filter of a state that stays (Durbin and Koopman, Time Series Analysis by State Space Methods,
2012, Sec. 4.3). The z are L^-1 d, L being the Cholesky factor of C in the order of the data, and det C is the
product of the v. No matrix is larger than R x R, and any number of rows is done at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray


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
