"""Where the walkers of the sampler start."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.exact.importance import WeightedDraws
from swesbi.exact.protocols import LikelihoodModel
from swesbi.prior import from_logit, to_logit

FloatArray = NDArray[np.float64]
INFLATION: Final = 4.0  # of the covariance of the weighted draws: twice their spread
LEAST_SD: Final = 0.1  # in eta; a few dominating weights have no spread of their own
ATTEMPTS: Final = 100


def starting_points(
    model: LikelihoodModel, weighted: WeightedDraws, count: int, rng: np.random.Generator
) -> FloatArray:
    """Return distinct phi (count, 4) that have a likelihood: draws of the proposal, picked at random.

    Where the proposal itself has too few, over-dispersed points about the weighted draws fill up.

    Raises:
        ValueError: Not enough points with a likelihood are found there either.
    """
    usable = ~weighted.from_prior & np.isfinite(weighted.log_likelihood)
    phi = np.unique(weighted.phi[usable], axis=0)
    if len(phi) >= count:
        return phi[rng.choice(len(phi), count, replace=False)]
    found = phi[rng.permutation(len(phi))]
    return np.concatenate([found, overdispersed(model, weighted, count - len(phi), rng)])


def overdispersed(
    model: LikelihoodModel, weighted: WeightedDraws, count: int, rng: np.random.Generator
) -> FloatArray:
    """Return phi (count, 4) with a likelihood, normal in eta with twice the spread of the weighted draws.

    Raises:
        ValueError: Not enough points with a likelihood are found.
    """
    prior = model.settings.prior
    eta = to_logit(weighted.phi, prior)
    mean = weighted.weight @ eta
    covariance = (eta - mean).T @ ((eta - mean) * weighted.weight[:, None])
    covariance = INFLATION * covariance + LEAST_SD**2 * np.eye(len(mean))
    found = np.empty((0, len(mean)))
    for _ in range(ATTEMPTS):
        phi = from_logit(rng.multivariate_normal(mean, covariance, count), prior)
        found = np.concatenate([found, phi[np.isfinite(model.log_likelihood(phi))]])
        if len(found) >= count:
            return found[:count]
    raise ValueError(
        f"only {len(found)} of {count} starting points for MCMC have a likelihood: nearly every simulation "
        "fails about the weighted draws; check the subject's context"
    )
