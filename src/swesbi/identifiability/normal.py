"""Independent normal data whose mean and standard deviation both depend on the parameters.

For y_i ~ N(m_i(x), s_i(x)^2), with z_i = (y_i - m_i) / s_i, the score and the expected information are

    d log L / dx_j = sum_i z_i / s_i  dm_i/dx_j + (z_i^2 - 1) d log s_i / dx_j
    I_jk = sum_i 1 / s_i^2  dm_i/dx_j dm_i/dx_k + 2  d log s_i / dx_j  d log s_i / dx_k

(Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, Eq. 3.31, for a diagonal
covariance). The second terms are what the spread of the data tells beside their mean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.speed_model.likelihood import normal_log_density

FloatArray = NDArray[np.float64]


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
    mean, log_sd = (part.reshape(-1, *x.shape[:1], part.shape[1]) for part in (moments.mean, moments.log_sd))
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
    own = np.einsum("njp,nkp->npjk", mean_by, mean_by)
    return np.asarray(own + 2.0 * np.einsum("njp,nkp->npjk", at.log_sd_by, at.log_sd_by))
