"""The posterior of the paper: the network's draws within the prior's bounds, and their summary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi import artefacts
from swesbi.draws import interval_levels
from swesbi.parameters import PHI, THETA_COLUMNS, THETA_NAMES
from swesbi.posterior.settings import PosteriorSettings
from swesbi.prior import PriorSettings, in_bounds

FloatArray = NDArray[np.float64]
COLUMNS: Final = {
    parameter.name: artefacts.Variable("", parameter.cf_unit, f"{parameter.meaning} {parameter.text}{{of}}")
    for parameter in PHI
}
"""One dataset a parameter of phi, of theta but for the last."""


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
        artefacts.Variable(
            "draw", "1", "whether the draw lies within the prior's bounds", "in_prior", "unfiltered"
        ),
    ]
    median: Annotated[FloatArray, artefacts.Variable("parameter", THETA_COLUMNS, "posterior median")]
    interval: Annotated[
        FloatArray, artefacts.Variable("parameter bound", THETA_COLUMNS, "equal-tailed credible interval")
    ]
    interval_mass: Annotated[float, artefacts.Variable("", "1", "mass of the credible interval")]
    correlation: Annotated[
        FloatArray, artefacts.Variable("parameter other_parameter", "1", "posterior correlation")
    ]
    component_names: Annotated[tuple[str, ...], artefacts.Labels("component")]
    z_obs: Annotated[
        FloatArray, artefacts.Variable("component", "1", "standardised observed conditioning vector")
    ]


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


def columns_along(along: str, names: Sequence[str], of: str = "") -> dict[str, artefacts.Variable]:
    """Return the datasets of some parameters along dimensions; ``of`` ends their meanings."""
    part = artefacts.Part(along=along, words={"of": of})
    return {name: part.place(replace(COLUMNS[name], name=name)) for name in names}


CHAINS: Final = columns_along("chain draw", THETA_NAMES)
SUMMARY: Final = artefacts.schema_of(Posterior)
SCHEMA: Final = {
    "/": SUMMARY["/"],
    "posterior": CHAINS,
    "unfiltered": columns_along("draw", THETA_NAMES, ", not filtered") | SUMMARY["unfiltered"],
}
POSTERIOR: Final = artefacts.register("posterior", SCHEMA, ("parameter", *artefacts.labels_of(Posterior)))


def posterior_to_groups(posterior: Posterior) -> dict[str, xr.Dataset]:
    """Return the groups of ``posterior.h5``; the group ``posterior`` follows ArviZ: (chain, draw)."""
    labels = {
        "parameter": list(THETA_NAMES),
        "other_parameter": list(THETA_NAMES),
        "bound": ["lower", "upper"],
        "component": list(posterior.component_names),
    }
    values = artefacts.values_of(posterior)
    draws = {"chain": [0], "draw": np.arange(len(posterior.theta))}
    chains = columns_of(posterior.theta[None], THETA_NAMES)
    candidates = columns_of(posterior.unfiltered, THETA_NAMES) | values["unfiltered"]
    first = {"draw": np.arange(len(posterior.unfiltered))}
    return {
        "/": artefacts.build_dataset(SCHEMA["/"], values["/"], labels),
        "posterior": artefacts.build_dataset(SCHEMA["posterior"], chains, draws),
        "unfiltered": artefacts.build_dataset(SCHEMA["unfiltered"], candidates, first),
    }


def read_posterior(path: Path) -> Posterior:
    """Read ``posterior.h5``.

    Raises:
        ArtefactError: The file is not a posterior.
    """
    groups = {group: artefacts.load(path, POSTERIOR, group)[0] for group in SCHEMA}
    draws = {
        "theta": rows_of(groups["posterior"].isel(chain=0), THETA_NAMES),
        "unfiltered": rows_of(groups["unfiltered"], THETA_NAMES),
    }
    return artefacts.from_groups(Posterior, groups, draws)


def columns_of(draws: FloatArray, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return draws (..., parameters) by the parameter's name."""
    return {name: draws[..., j] for j, name in enumerate(names)}


def rows_of(group: xr.Dataset, names: Sequence[str]) -> FloatArray:
    """Put the draws of some parameters together, shape (n, parameters)."""
    return np.stack([group[name].to_numpy() for name in names], axis=1)
