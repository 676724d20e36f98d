"""Prior simulations as HDF5 shards."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from swesbi.artefacts import ArtefactError, from_dataset, load, register, schema_of
from swesbi.artefacts import to_dataset as stored
from swesbi.forward_model.periodic import Status
from swesbi.parameters import THETA_NAMES
from swesbi.simulations.draw import PriorSimulations

LABELS: Final = {"parameter": list(THETA_NAMES), "status": [status.name.lower() for status in Status]}
KIND: Final = register("simulations", schema_of(PriorSimulations), LABELS)


def to_dataset(simulations: PriorSimulations) -> xr.Dataset:
    """Return the simulations as a dataset with dimensions simulation, parameter, cycle and status."""
    return stored(simulations, LABELS)


def read_simulations(shards: Sequence[Path]) -> PriorSimulations:
    """Read the shards of one subject, in the order of the draws whatever the order of the files.

    Raises:
        ArtefactError: The shards belong to several subjects, or a draw is missing or doubled.
    """
    loaded = [load(path, KIND) for path in shards]
    if len(subjects := {provenance.subject for _, provenance in loaded}) > 1:
        raise ArtefactError(
            f"{shards[0]} and others: shards of several subjects {sorted(subjects)} given as one"
        )
    merged = xr.concat([dataset for dataset, _ in loaded], dim="simulation", data_vars="minimal").sortby(
        "draw_index"
    )
    draws = merged["draw_index"].to_numpy()
    if not np.array_equal(draws, np.arange(len(draws))):
        raise ArtefactError(
            f"{shards[0]} and others: draws are missing or doubled; delete these shards and rerun"
        )
    return from_dataset(PriorSimulations, merged)


def group_by_subject(shards: Sequence[Path]) -> dict[str, list[Path]]:
    """Group shard files by the subject named in their provenance."""
    groups: dict[str, list[Path]] = {}
    for path in shards:
        groups.setdefault(load(path, KIND)[1].subject, []).append(path)
    return groups
