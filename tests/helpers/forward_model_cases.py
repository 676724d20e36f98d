"""The shipped settings of the forward model and the contexts of A to F, for its tests."""

from __future__ import annotations

import numpy as np
import speed_case

from swesbi.context import Context

SETTINGS = speed_case.shipped().forward_model
COHORT = {
    "A": Context("A", "M", 24, 1.88, 57, 118, 45, 0.88),
    "B": Context("B", "F", 27, 1.68, 64, 84, 31, 0.74),
    "C": Context("C", "M", 21, 1.94, 69, 112, 42, 0.90),
    "D": Context("D", "F", 19, 1.62, 78, 78, 28, 0.70),
    "E": Context("E", "M", 22, 1.80, 72, 99, 37, 0.78),
    "F": Context("F", "F", 20, 1.55, 84, 68, 24, 0.64),
}
RICHER = SETTINGS.model_copy(update={"valves": "inertance", "wall_inertia": True, "maximum_step_s": 1.4e-3})


def prior_draws(n: int, seed: int) -> np.ndarray:
    """Draw theta (n, 3) from the paper's bounded log-Gaussian prior, by rejection."""
    rng = np.random.default_rng(seed)
    kept = np.empty((0, 3))
    while kept.shape[0] < n:
        log_theta = np.log([45.0, 5.0, 30.0]) + np.array([0.5, 0.6, 0.45]) * rng.standard_normal((2 * n, 3))
        theta = np.exp(log_theta)
        inside = ((theta >= [10.0, 2.0, 2.0]) & (theta <= [200.0, 30.0, 60.0])).all(axis=1)
        kept = np.concatenate([kept, theta[inside]])
    return kept[:n]
