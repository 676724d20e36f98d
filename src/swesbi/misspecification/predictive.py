"""Posterior predictive checks of one recording, from the weighted draws of its exact posterior.

Replicated recordings carry the noise and the discrepancy of the observation model and pass the operator
S(.) as the recording does (Gelman, Meng and Stern, Statistica Sinica 6:733, 1996).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from swesbi.speed_model.likelihood import draw_speeds, residuals
from swesbi.speed_model.prediction import PredictedSpeeds
from swesbi.speed_model.recording import SpeedRecording
from swesbi.speed_model.settings import DiscrepancySettings

FloatArray = NDArray[np.float64]
LEAST_TAIL: Final = 1e-3  # what some hundred weighted draws can resolve


def chi2_p_value(
    predicted: PredictedSpeeds,
    weight: FloatArray,
    recording: SpeedRecording,
    discrepancy: DiscrepancySettings,
) -> float:
    """Return the posterior predictive p-value of chi2 = sum z^2 over the p measured phases.

    At given phi the replicated chi2 has p degrees of freedom, so its tail probability is known and is
    averaged over the posterior.
    """
    z = residuals(predicted, recording, discrepancy)
    tail = chi2.sf((z**2).sum(axis=1), z.shape[1])
    return float(weight @ np.where(weight > 0.0, tail, 0.0))


def replicate_speeds(
    predicted: PredictedSpeeds,
    weight: FloatArray,
    recording: SpeedRecording,
    discrepancy: DiscrepancySettings,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Draw one replicated recording for each draw that has weight.

    Returns:
        Speeds in m/s of shape (m, p), and the weights of shape (m,).
    """
    kept = weight > 0.0
    part = PredictedSpeeds(predicted.log_speed[kept], predicted.slope[kept])
    return draw_speeds(part, recording.relative_se, discrepancy, rng), weight[kept] / weight[kept].sum()


def tail_probabilities(observed: FloatArray, replicated: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the predictive probability of a smaller value than the observed one, ties by half; (F,).

    Args:
        observed: Features of the recording; shape (F,).
        replicated: Features of replicated recordings; shape (m, F).
        weight: Their weights, which sum to one; shape (m,).
    """
    below = (replicated < observed) + 0.5 * (replicated == observed)
    return np.asarray(weight @ below)


def tail_scores(tails: FloatArray) -> FloatArray:
    """Return the size of each tail probability's normal score, of any shape; 0 in the middle."""
    return np.asarray(np.abs(norm.ppf(np.clip(tails, LEAST_TAIL, 1.0 - LEAST_TAIL))))
