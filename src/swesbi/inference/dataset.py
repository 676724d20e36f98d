"""The training pool and the posterior as datasets, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from swesbi.artefacts import (
    Part,
    Variable,
    build_dataset,
    from_dataset,
    from_groups,
    labels_of,
    load,
    register,
    schema_of,
    to_dataset,
    values_of,
)
from swesbi.inference.pool import Pool
from swesbi.inference.posterior import Posterior
from swesbi.inference.standardisation import FloatArray
from swesbi.parameters import THETA_NAMES

POOL: Final = register("pool", schema_of(Pool), (*labels_of(Pool), "parameter"))
COLUMNS: Final = {
    "k0_kpa": Variable("", "kPa", "active stiffness scale k_0{of}"),
    "k_atp_per_s": Variable("", "s-1", "contraction rate k_ATP{of}"),
    "k_sr_per_s": Variable("", "s-1", "relaxation rate k_SR{of}"),
    "passive_scale_kpa": Variable("", "kPa", "passive scale a{of}"),
}
"""One dataset a parameter of phi, of theta but for the last."""


def columns_along(along: str, names: Sequence[str], of: str = "") -> dict[str, Variable]:
    """Return the datasets of some parameters along dimensions; ``of`` ends their meanings."""
    part = Part(along=along, words={"of": of})
    return {name: part.place(replace(COLUMNS[name], name=name)) for name in names}


CHAINS: Final = columns_along("chain draw", THETA_NAMES)
SUMMARY: Final = schema_of(Posterior)
SCHEMA: Final = {
    "/": SUMMARY["/"],
    "posterior": CHAINS,
    "unfiltered": columns_along("draw", THETA_NAMES, ", not filtered") | SUMMARY["unfiltered"],
}
POSTERIOR: Final = register("posterior", SCHEMA, ("parameter", *labels_of(Posterior)))


def pool_to_dataset(pool: Pool) -> xr.Dataset:
    """Return the pool with dimensions sample, parameter, component and subject."""
    return to_dataset(pool, {"parameter": list(THETA_NAMES)})


def pool_from_dataset(dataset: xr.Dataset) -> Pool:
    """Rebuild the pool from its dataset."""
    return from_dataset(Pool, dataset)


def read_pool(path: Path) -> Pool:
    """Read ``pool.h5``.

    Raises:
        ArtefactError: The file is not a pool.
    """
    return pool_from_dataset(load(path, POOL)[0])


def posterior_to_groups(posterior: Posterior) -> dict[str, xr.Dataset]:
    """Return the groups of ``posterior.h5``; the group ``posterior`` follows ArviZ: (chain, draw)."""
    labels = {
        "parameter": list(THETA_NAMES),
        "other_parameter": list(THETA_NAMES),
        "bound": ["lower", "upper"],
        "component": list(posterior.component_names),
    }
    values = values_of(posterior)
    draws = {"chain": [0], "draw": np.arange(len(posterior.theta))}
    chains = columns_of(posterior.theta[None], THETA_NAMES)
    candidates = columns_of(posterior.unfiltered, THETA_NAMES) | values["unfiltered"]
    first = {"draw": np.arange(len(posterior.unfiltered))}
    return {
        "/": build_dataset(SCHEMA["/"], values["/"], labels),
        "posterior": build_dataset(SCHEMA["posterior"], chains, draws),
        "unfiltered": build_dataset(SCHEMA["unfiltered"], candidates, first),
    }


def read_posterior(path: Path) -> Posterior:
    """Read ``posterior.h5``.

    Raises:
        ArtefactError: The file is not a posterior.
    """
    groups = {group: load(path, POSTERIOR, group)[0] for group in SCHEMA}
    draws = {
        "theta": rows_of(groups["posterior"].isel(chain=0), THETA_NAMES),
        "unfiltered": rows_of(groups["unfiltered"], THETA_NAMES),
    }
    return from_groups(Posterior, groups, draws)


def columns_of(draws: FloatArray, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return draws (..., parameters) by the parameter's name."""
    return {name: draws[..., j] for j, name in enumerate(names)}


def rows_of(group: xr.Dataset, names: Sequence[str]) -> FloatArray:
    """Put the draws of some parameters together, shape (n, parameters)."""
    return np.stack([group[name].to_numpy() for name in names], axis=1)
