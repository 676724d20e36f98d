"""Joint expected coverage by distances to a random point (TARP).

Lemos, Coogan, Hezaveh and Perreault-Levasseur (2023), Sampling-based accuracy testing of posterior
estimators for general inference, ICML. The function of sbi takes its own posterior objects and equally
weighted draws; this one takes arrays with weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.calibration.levels import level_of_truth
from swesbi.prior import BoxPrior, quantile

FloatArray = NDArray[np.float64]


def standardised(phi: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return log(phi / centre) / log_sd of shape (..., d), in which distances are taken."""
    centre = np.array([parameter.centre for parameter in prior.parameters])
    log_sd = np.array([parameter.log_sd for parameter in prior.parameters])
    return np.asarray(np.log(phi / centre) / log_sd)


def reference_points(count: int, prior: BoxPrior, rng: np.random.Generator) -> FloatArray:
    """Draw a reference point for each recording, from the prior and independent of everything; (count, d)."""
    return standardised(quantile(rng.random((count, len(prior.parameters))), prior), prior)


def tarp_level(
    truth: FloatArray, draws: FloatArray, weight: FloatArray, reference: FloatArray, prior: BoxPrior
) -> float:
    """Return the posterior mass nearer to the reference point than the truth; uniform if calibrated.

    Args:
        truth: True phi; shape (d,).
        draws: Posterior draws; shape (n, d).
        weight: Normalised weights; shape (n,).
        reference: A standardised reference point; shape (d,).
        prior: Sets the scale of each parameter.
    """
    of_truth = np.linalg.norm(standardised(truth[None], prior) - reference, axis=1)
    of_draws = np.linalg.norm(standardised(draws, prior) - reference, axis=1)
    return float(level_of_truth(of_truth, of_draws[:, None], weight)[0])
