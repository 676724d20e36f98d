"""The curve-level loss that CMA-ES minimises."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.settings import CurveLossSettings

FloatArray = NDArray[np.float64]

FAILED_LOSS = 1e3
"""Loss of a simulation that failed: finite, and worse than any curve's (a perfect curve has 0)."""


def curve_loss(curves: FloatArray, observed: FloatArray, weights: CurveLossSettings) -> FloatArray:
    """Return the loss of each curve: MAE / range + (1 - r) + |peak - observed peak| / observed peak.

    The paper (Sec. 2.5) names the three terms: normalised MAE, correlation mismatch, peak mismatch.
    A constant curve has no correlation; its r counts as 0.

    Args:
        curves: (n, points) simulated curves; a row with a value that is not finite is a failed simulation.
        observed: (points,) observed curve, same unit.
        weights: Of the three terms.

    Returns:
        (n,) losses, dimensionless; ``FAILED_LOSS`` for failed simulations.
    """
    failed = ~np.all(np.isfinite(curves), axis=1)
    usable = np.where(failed[:, None], observed, curves)
    mae = np.mean(np.abs(usable - observed), axis=1) / np.ptp(observed)
    peak = np.abs(usable.max(axis=1) - observed.max()) / observed.max()
    loss = (
        weights.mae_weight * mae
        + weights.correlation_weight * (1.0 - _correlation(usable, observed))
        + weights.peak_weight * peak
    )
    return np.where(failed, FAILED_LOSS, loss)


def _correlation(curves: FloatArray, observed: FloatArray) -> FloatArray:
    """Pearson's r of each curve with the observed one; 0 for a constant curve."""
    deviation = curves - curves.mean(axis=1, keepdims=True)
    target = observed - observed.mean()
    norm = np.linalg.norm(deviation, axis=1) * np.linalg.norm(target)
    r: FloatArray = np.divide(deviation @ target, norm, out=np.zeros(len(curves)), where=norm > 0.0)
    return r
