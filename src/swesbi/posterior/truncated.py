"""The posterior of the paper: the network's draws within the prior's bounds, and their summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from swesbi import artefacts
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels
from swesbi.parameters import PHI, THETA_COLUMNS, THETA_NAMES
from swesbi.posterior.settings import PosteriorSettings
from swesbi.prior import PriorSettings, in_bounds

COLUMNS: Final = {
    parameter.name: artefacts.Variable("", parameter.cf_unit, f"{parameter.meaning} {parameter.text}{{of}}")
    for parameter in PHI
}
"""One dataset a parameter of phi, of theta but for the last."""


@dataclass(frozen=True)
class Posterior(artefacts.Artefact, kind="posterior"):
    """Draws and summary of one subject's posterior; the summary is NaN where there are too few draws.

    theta (n, 3) lies within the prior's bounds, n may be zero. ``unfiltered`` (m, 3) holds the first
    candidates as they came.
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

    labels = {
        "parameter": list(THETA_NAMES),
        "other_parameter": list(THETA_NAMES),
        "bound": ["lower", "upper"],
    }

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file: each parameter's draws are a dataset."""
        return SCHEMA

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the groups of the file; the group ``posterior`` follows ArviZ: (chain, draw)."""
        own = artefacts.to_groups(self, self.labels)
        draws = {"chain": [0], "draw": np.arange(len(self.theta))}
        chains = columns_of(self.theta[None], THETA_NAMES)
        candidates = columns_of(self.unfiltered, THETA_NAMES) | artefacts.values_of(self)["unfiltered"]
        first = {"draw": np.arange(len(self.unfiltered))}
        return {
            "/": own["/"],
            "posterior": artefacts.build_group(SCHEMA["posterior"], chains, draws),
            "unfiltered": artefacts.build_group(SCHEMA["unfiltered"], candidates, first),
        }

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> Posterior:
        """Return what the groups of a file hold."""
        draws = {
            "theta": rows_of(groups["posterior"].at("chain", 0), THETA_NAMES),
            "unfiltered": rows_of(groups["unfiltered"], THETA_NAMES),
        }
        return artefacts.from_groups(cls, groups, draws)


def summarise_posterior(
    candidates: FloatArray,
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    prior: PriorSettings,
    settings: PosteriorSettings,
) -> Posterior:
    """Keep the first in-prior candidates of (n, 3) and summarise them.

    Keeping the candidates within the bounds, in order, draws from q(theta | z_obs) truncated to the
    prior's box.
    """
    inside = in_bounds(candidates, prior)
    theta = candidates[inside][: settings.draws]
    first = slice(settings.unfiltered_draws)
    return summary_of(
        theta, candidates[first], inside[first], z_obs, component_names, interval=settings.interval
    )


def summary_of(
    theta: FloatArray,
    unfiltered: FloatArray,
    in_prior: NDArray[np.bool_],
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    *,
    interval: float,
) -> Posterior:
    """Summarise draws (n, 3) that are known to lie within the prior's bounds, beside the first (m, 3)."""
    return Posterior(
        theta=theta,
        unfiltered=unfiltered,
        unfiltered_in_prior=in_prior,
        median=_quantiles(theta, np.array([0.5]))[:, 0],
        interval=_quantiles(theta, interval_levels(interval)),
        interval_mass=interval,
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


def columns_of(draws: FloatArray, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return draws (..., parameters) by the parameter's name."""
    return {name: draws[..., j] for j, name in enumerate(names)}


def rows_of(group: artefacts.Group, names: Sequence[str]) -> FloatArray:
    """Put the draws of some parameters together, shape (n, parameters)."""
    return np.stack([group[name].to_numpy() for name in names], axis=1)
