"""Linear normal toys whose information, profiles and posteriors are known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.checks.identifiability.likelihood import Moments, NormalProblem
from swesbi.checks.identifiability.settings import IdentifiabilitySettings

FloatArray = NDArray[np.float64]
SLOPES = np.array([[1.0, 0.5, 0.0], [0.2, 1.0, 0.3], [0.0, -0.4, 1.0], [1.0, 1.0, 1.0], [0.5, 0.0, -1.0]])
LOG_SD_SLOPES = np.array(
    [[0.6, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, -0.7], [0.3, 0.2, 0.0], [0.0, 0.5, 0.1]]
)
SD = np.array([0.3, 0.2, 0.5, 0.4, 0.25])
NOTHING_SHARED = np.empty((5, 0))
OBSERVED = np.array([0.4, -0.1, 0.7, 1.2, 0.2])


def linear(x: FloatArray) -> Moments:
    """Mean A x and a fixed sd."""
    return Moments(x @ SLOPES.T, np.broadcast_to(np.log(SD), (len(x), len(SD))), NOTHING_SHARED)


def heteroscedastic(x: FloatArray) -> Moments:
    """Mean A x and log sd B x: both tell of x."""
    return Moments(x @ SLOPES.T, np.log(SD) + x @ LOG_SD_SLOPES.T, NOTHING_SHARED)


def problem(reach: float = 20.0) -> NormalProblem:
    bound = np.full(SLOPES.shape[1], reach)
    return NormalProblem(linear, OBSERVED, -bound, bound, 0.01)


def precision() -> FloatArray:
    """A' W A, the information of the linear toy."""
    return np.asarray(SLOPES.T @ np.diag(SD**-2.0) @ SLOPES)


def least_squares() -> FloatArray:
    return np.asarray(np.linalg.solve(precision(), SLOPES.T @ (OBSERVED / SD**2)))


def tiny() -> IdentifiabilitySettings:
    """Settings for a run of seconds."""
    return IdentifiabilitySettings.from_plain(
        {
            "interval": 0.9,
            "difference_step": 0.02,
            "information_draws": 6,
            "shown_draws": 40,
            "profile": {
                "confidence_levels": [0.5, 0.9, 0.99],
                "coarse_points": 9,
                "points": 9,
                "pair_points": 9,
                "prior_starts": 100,
                "searches": 4,
            },
            "design": {
                "draws": 6,
                "repeats": [1, 3, 6],
                "phases": [8, 20, 30],
                "offsets": 2,
                "discrepancy_range_cycle": 0.05,
                "placement_candidates": 20,
                "placement_phases": 8,
                "placement_draws": 2,
            },
        }
    )
