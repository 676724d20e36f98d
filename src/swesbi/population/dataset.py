"""The simulations over a population as shards, and back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.population import SCHEMAS
from swesbi.forward_model.periodic import Status
from swesbi.parameters import THETA_NAMES
from swesbi.population.context_dataset import context_values, contexts_of
from swesbi.population.simulations import PopulationSimulations

KIND: Final = "population_simulations"
SCHEMA: Final = SCHEMAS[KIND]["/"]
ARRAYS: Final = (
    "theta",
    "active_stiffness_kpa",
    "active_slope_kpa",
    "passive_shape",
    "passive_slope",
    "failures",
)


def to_dataset(made: PopulationSimulations) -> xr.Dataset:
    """Return the simulations as a dataset with dimensions context, draw and phase."""
    values: dict[str, Any] = {name: getattr(made, name) for name in ARRAYS}
    labels = {
        "parameter": list(THETA_NAMES),
        "status": [status.name.lower() for status in Status],
        "subject": ("context", [one.subject for one in made.contexts]),
    }
    return build_dataset(SCHEMA, values | context_values(made.contexts), labels)


def read_population(shards: Sequence[Path]) -> PopulationSimulations:
    """Read the shards of the training set, in the order of the contexts whatever the order of the files.

    Raises:
        ArtefactError: A file is no such shard.
    """
    merged = xr.concat([load(path, KIND)[0] for path in shards], dim="context").sortby("subject")
    return PopulationSimulations(
        contexts_of(merged), **{name: np.ascontiguousarray(merged[name].to_numpy()) for name in ARRAYS}
    )
