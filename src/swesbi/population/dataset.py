"""The simulations over a population as shards, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from swesbi.artefacts import Labels, build_dataset, from_dataset, load, register, schema_of, values_of
from swesbi.context import Context
from swesbi.forward_model.periodic import Status
from swesbi.parameters import THETA_NAMES
from swesbi.population.simulations import PopulationSimulations
from swesbi.recording.dataset import context_values, contexts_of

ALONG: Final = "context"
SCHEMA: Final = schema_of(Context, ALONG)["/"] | schema_of(PopulationSimulations)["/"]
LABELS: Final = {"parameter": list(THETA_NAMES), "status": [status.name.lower() for status in Status]}
KIND: Final = register("population_simulations", {"/": SCHEMA}, (*LABELS, Labels(ALONG, "subject")))


def to_dataset(made: PopulationSimulations) -> xr.Dataset:
    """Return the simulations as a dataset with dimensions context, draw and phase."""
    subjects = {"subject": (ALONG, [one.subject for one in made.contexts])}
    return build_dataset(SCHEMA, values_of(made)["/"] | context_values(made.contexts), LABELS | subjects)


def read_population(shards: Sequence[Path]) -> PopulationSimulations:
    """Read the shards of the training set, in the order of the contexts whatever the order of the files.

    Raises:
        ArtefactError: A file is no such shard.
    """
    merged = xr.concat([load(path, KIND)[0] for path in shards], dim="context").sortby("subject")
    rebuilt = from_dataset(PopulationSimulations, merged, contexts=contexts_of(merged, ALONG))
    arrays: dict[str, Any] = {
        name: np.ascontiguousarray(value) for name, value in values_of(rebuilt)["/"].items()
    }
    return replace(rebuilt, **arrays)
