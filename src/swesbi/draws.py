"""What is computed of draws from a distribution: intervals, effective number, densities, resampling."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray


def interval_levels(mass: float) -> FloatArray:
    """Return the two quantile levels that enclose the equal-tailed interval of this mass."""
    return np.array([0.5 - 0.5 * mass, 0.5 + 0.5 * mass])


def median_and_interval(draws: FloatArray, mass: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lower end, median and upper end of draws along their first axis; shape of one draw each."""
    low, high = interval_levels(mass)
    low_end, median, high_end = np.quantile(draws, [low, 0.5, high], axis=0)
    return low_end, median, high_end


def equal_weights(draws: int) -> FloatArray:
    """Return weights 1/n of shape (n,)."""
    return np.full(draws, 1.0 / draws)


def normalised(log_weight: FloatArray) -> FloatArray:
    """Return weights that add up to one; shape (n,)."""
    return np.asarray(np.exp(log_weight - logsumexp(log_weight)))


def effective_draws(weight: FloatArray) -> float:
    """Return the effective number of draws, 1 / sum w^2, of normalised weights (n,) (Kish 1965)."""
    return float(1.0 / (weight**2).sum())


CELLS: Final = 8  # of draws, a width of the kernel
REACH: Final = 6.0  # widths, beyond which a normal kernel is nothing


def kernel_density(draws: FloatArray, at: FloatArray, width: float | None = None) -> FloatArray:
    """Return the density of draws (n,) by normal kernels at points (m,), in ascending order; shape (m,).

    Without a width it is that of Scott (Multivariate Density Estimation, 1992), sd n^(-1/5). Draws are first
    shared among the two nearest of evenly spaced cells, which widens a kernel by a thousandth (Jones and
    Lotwick 1984, Appl Stat 33:120).
    """
    sd = width or float(draws.std(ddof=1)) * len(draws) ** -0.2
    low, high = float(at[0]) - REACH * sd, float(at[-1]) + REACH * sd
    near = draws[(draws >= low) & (draws <= high)]
    cells: FloatArray = near
    share: FloatArray = np.ones(len(near))
    if (count := int(CELLS * (high - low) / sd)) < len(near):
        cells = np.linspace(low, high, count)
        place = (near - low) / (cells[1] - low)
        below = np.minimum(place.astype(np.int64), count - 2)
        above = place - below
        share = np.asarray(
            np.bincount(below, 1.0 - above, count) + np.bincount(below + 1, above, count), np.float64
        )
    z = (at[:, None] - cells) / sd
    return np.asarray(np.exp(-0.5 * z**2) @ share / (len(draws) * sd * np.sqrt(2.0 * np.pi)))


FINER: Final = 3  # cells of a count of pairs, a point of the grid


def density_of_pairs(x: FloatArray, y: FloatArray, across: FloatArray, up: FloatArray) -> FloatArray:
    """Return the density of draws x, y (n,), but for a factor, at even points (k,) and (m,); shape (m, k).

    The kernel is normal with the covariance of the draws times n^(-1/3) (Scott, Multivariate Density
    Estimation, 1992). Draws are counted in cells finer than the points, and folded with it by FFT.
    """
    lattice = [np.linspace(ends[0], ends[-1], FINER * (len(ends) - 1) + 1) for ends in (up, across)]
    step = [float(points[1] - points[0]) for points in lattice]
    edges = [
        np.append(points - 0.5 * d, points[-1] + 0.5 * d) for points, d in zip(lattice, step, strict=True)
    ]
    counts, _, _ = np.histogram2d(y, x, bins=edges)
    size = tuple(2 * length for length in counts.shape)
    offsets = np.meshgrid(
        *(d * length * np.fft.fftfreq(length) for d, length in zip(step, size, strict=True)), indexing="ij"
    )
    inverse = np.linalg.inv(np.cov(y, x) * len(x) ** (-1.0 / 3.0))
    kernel = np.exp(-0.5 * np.einsum("iab,ij,jab->ab", offsets, inverse, offsets))
    folded = np.fft.irfft2(np.fft.rfft2(counts, size) * np.fft.rfft2(kernel), size)
    density = folded[: counts.shape[0] : FINER, : counts.shape[1] : FINER]
    return np.asarray(np.maximum(density, 0.0))


def resampled_rows(weight: FloatArray, draws: int, rng: np.random.Generator) -> NDArray[np.int_]:
    """Return the rows of equally weighted draws, (draws,), by systematic resampling (Kitagawa 1996).

    Each row is taken as often as its weight (n,), known up to a factor, says, rounded up or down.
    """
    levels = (np.arange(draws) + rng.random()) / draws
    edges = np.cumsum(weight)
    return np.searchsorted(edges / edges[-1], levels, side="right")
