"""The posterior draws of one subject and their summary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Labels, Variable
from swesbi.inference.settings import PosteriorSettings
from swesbi.intervals import interval_levels
from swesbi.parameters import THETA_COLUMNS
from swesbi.prior import PriorSettings, in_bounds

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Posterior:
    """Draws and summary of one subject's posterior; the summary is NaN where there are too few draws.

    Attributes:
        theta: (n, 3) draws within the prior's bounds; n may be zero.
        unfiltered: (m, 3) the first candidates as they came.
    """

    theta: FloatArray
    unfiltered: FloatArray
    unfiltered_in_prior: Annotated[
        NDArray[np.bool_],
        Variable("draw", "1", "whether the draw lies within the prior's bounds", "in_prior", "unfiltered"),
    ]
    median: Annotated[FloatArray, Variable("parameter", THETA_COLUMNS, "posterior median")]
    interval: Annotated[
        FloatArray, Variable("parameter bound", THETA_COLUMNS, "equal-tailed credible interval")
    ]
    interval_mass: Annotated[float, Variable("", "1", "mass of the credible interval")]
    correlation: Annotated[FloatArray, Variable("parameter other_parameter", "1", "posterior correlation")]
    component_names: Annotated[tuple[str, ...], Labels("component")]
    z_obs: Annotated[FloatArray, Variable("component", "1", "standardised observed conditioning vector")]


def summarise_posterior(
    candidates: FloatArray,
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    prior: PriorSettings,
    settings: PosteriorSettings,
) -> Posterior:
    """Keep the first in-prior candidates and summarise them.

    Keeping the candidates within the bounds, in order, draws from q(theta | z_obs) truncated to the
    prior's box.

    Args:
        candidates: (n, 3) draws from the estimator given z_obs.
        z_obs: (C,) observed conditioning vector.
        component_names: Names of its components.
        prior: The prior whose bounds count.
        settings: How many draws are kept, and the interval's mass.
    """
    inside = in_bounds(candidates, prior)
    theta = candidates[inside][: settings.draws]
    first = slice(settings.unfiltered_draws)
    return Posterior(
        theta=theta,
        unfiltered=candidates[first],
        unfiltered_in_prior=inside[first],
        median=_quantiles(theta, np.array([0.5]))[:, 0],
        interval=_quantiles(theta, interval_levels(settings.interval)),
        interval_mass=settings.interval,
        correlation=_correlation(theta),
        component_names=component_names,
        z_obs=z_obs,
    )


def _quantiles(theta: FloatArray, levels: FloatArray) -> FloatArray:
    """Quantiles of shape (3, levels); NaN without draws."""
    if not len(theta):
        return np.full((theta.shape[1], len(levels)), np.nan)
    return np.quantile(theta, levels, axis=0).T


def _correlation(theta: FloatArray) -> FloatArray:
    """Pairwise correlations; NaN with fewer than three draws, where every correlation would be +-1."""
    parameters = theta.shape[1]
    if len(theta) < 3:
        return np.full((parameters, parameters), np.nan)
    correlation: FloatArray = np.asarray(np.corrcoef(theta, rowvar=False))
    return correlation
