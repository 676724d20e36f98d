"""The training pool and the posterior as datasets, and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.inference import SCHEMAS
from swesbi.inference.pool import Components, Pool
from swesbi.inference.posterior import Posterior
from swesbi.inference.standardisation import Standardisation
from swesbi.parameters import THETA_NAMES

POOL = "pool"
POSTERIOR = "posterior"


def pool_to_dataset(pool: Pool) -> xr.Dataset:
    """Return the pool with dimensions sample, parameter, component and subject."""
    values = {
        name: getattr(pool, name)
        for name in ("theta", "z", "subject_index", "draw_index", "observed", "z_obs")
    }
    statistics = {"mean": pool.standardisation.mean, "scale": pool.standardisation.scale}
    return build_dataset(SCHEMAS[POOL]["/"], {**values, **statistics}).assign_coords(
        parameter=list(THETA_NAMES),
        component=list(pool.components.names),
        component_unit=("component", list(pool.components.units)),
        subject=list(pool.subjects),
    )


def pool_from_dataset(dataset: xr.Dataset) -> Pool:
    """Rebuild the pool from its dataset."""
    return Pool(
        components=Components(_texts(dataset["component"]), _texts(dataset["component_unit"])),
        standardisation=Standardisation(dataset["mean"].to_numpy(), dataset["scale"].to_numpy()),
        subjects=_texts(dataset["subject"]),
        theta=dataset["theta"].to_numpy(),
        z=dataset["z"].to_numpy(),
        subject_index=dataset["subject_index"].to_numpy(),
        draw_index=dataset["draw_index"].to_numpy(),
        observed=dataset["observed"].to_numpy(),
    )


def read_pool(path: Path) -> Pool:
    """Read ``pool.h5``.

    Raises:
        ArtefactError: The file is not a pool.
    """
    return pool_from_dataset(load(path, POOL)[0])


def posterior_to_groups(posterior: Posterior) -> dict[str, xr.Dataset]:
    """Return the groups of ``posterior.h5``; the group ``posterior`` follows ArviZ: (chain, draw)."""
    schema = SCHEMAS[POSTERIOR]
    names = ("median", "interval", "interval_mass", "correlation", "z_obs")
    summary = build_dataset(schema["/"], {name: getattr(posterior, name) for name in names}).assign_coords(
        parameter=list(THETA_NAMES),
        other_parameter=list(THETA_NAMES),
        bound=["lower", "upper"],
        component=list(posterior.component_names),
    )
    by_name = {name: posterior.theta[None, :, j] for j, name in enumerate(THETA_NAMES)}
    draws = build_dataset(schema["posterior"], by_name).assign_coords(
        chain=[0], draw=np.arange(len(posterior.theta))
    )
    by_name = {name: posterior.unfiltered[:, j] for j, name in enumerate(THETA_NAMES)}
    in_prior = posterior.unfiltered_in_prior.astype(np.int8)
    unfiltered = build_dataset(schema["unfiltered"], {**by_name, "in_prior": in_prior}).assign_coords(
        draw=np.arange(len(in_prior))
    )
    return {"/": summary, "posterior": draws, "unfiltered": unfiltered}


def read_posterior(path: Path) -> Posterior:
    """Read ``posterior.h5``.

    Raises:
        ArtefactError: The file is not a posterior.
    """
    root, draws, unfiltered = (load(path, POSTERIOR, group)[0] for group in ("/", "posterior", "unfiltered"))
    return Posterior(
        theta=np.stack([draws[name].to_numpy()[0] for name in THETA_NAMES], axis=1),
        unfiltered=np.stack([unfiltered[name].to_numpy() for name in THETA_NAMES], axis=1),
        unfiltered_in_prior=unfiltered["in_prior"].to_numpy().astype(bool),
        median=root["median"].to_numpy(),
        interval=root["interval"].to_numpy(),
        interval_mass=float(root["interval_mass"]),
        correlation=root["correlation"].to_numpy(),
        component_names=_texts(root["component"]),
        z_obs=root["z_obs"].to_numpy(),
    )


def _texts(array: xr.DataArray) -> tuple[str, ...]:
    return tuple(map(str, array.to_numpy()))
