"""Weights of draws: normalised, counted by their effective number, and exchanged for equal ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

FloatArray = NDArray[np.float64]


def equal_weights(draws: int) -> FloatArray:
    """Return weights 1/n of shape (n,)."""
    return np.full(draws, 1.0 / draws)


def normalised(log_weight: FloatArray) -> FloatArray:
    """Return weights that add up to one; shape (n,)."""
    return np.asarray(np.exp(log_weight - logsumexp(log_weight)))


def effective_draws(weight: FloatArray) -> float:
    """Return the effective number of draws, 1 / sum w^2, of normalised weights (n,) (Kish 1965)."""
    return float(1.0 / (weight**2).sum())


def resampled_rows(weight: FloatArray, draws: int, rng: np.random.Generator) -> NDArray[np.int_]:
    """Return the rows of equally weighted draws, (draws,), by systematic resampling (Kitagawa 1996).

    Each row is taken as often as its weight says, rounded up or down.

    Args:
        weight: Weights, up to a factor; shape (n,).
        draws: Number of rows.
        rng: Source of the one random number.
    """
    levels = (np.arange(draws) + rng.random()) / draws
    edges = np.cumsum(weight)
    return np.searchsorted(edges / edges[-1], levels, side="right")
