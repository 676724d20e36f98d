"""Calibration on fresh contexts as datasets, and back; parts and whole have the same groups."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from swesbi.artefacts import load
from swesbi.artefacts.kinds.population import SCHEMAS
from swesbi.calibration.dataset import diagnostics_of, inferred_dataset, ranked_of
from swesbi.calibration.ranked import Inferred
from swesbi.population.calibration import FreshInferred
from swesbi.population.context_dataset import context_values, contexts_of
from swesbi.population.recordings import ACQUIRED, OWN

KIND: Final = "population_calibration"
SCHEMA: Final = SCHEMAS[KIND]
REFUSED: Final = "refused"


def fresh_dataset(found: FreshInferred) -> xr.Dataset:
    """Return the recordings of fresh contexts as one group."""
    values = context_values(found.contexts) | {"relative_se": found.relative_se}
    schema = SCHEMA[OWN]
    added = {
        name: ("recording", value, {"units": schema[name].units, "long_name": schema[name].meaning})
        for name, value in values.items()
    }
    return inferred_dataset(found.inferred).assign(added).assign_attrs({REFUSED: found.refused})


def join(parts: Sequence[Path]) -> dict[str, xr.Dataset]:
    """Put the parts together, in the order given.

    Raises:
        ArtefactError: A file is no such part.
    """
    groups = {}
    for name in (OWN, ACQUIRED):
        loaded = [load(path, KIND, name)[0] for path in parts]
        refused = sum(int(one.attrs[REFUSED]) for one in loaded)
        groups[name] = xr.concat(loaded, dim="recording").assign_attrs({REFUSED: refused})
    return groups


def fresh_of(dataset: xr.Dataset) -> FreshInferred:
    """Rebuild the recordings of fresh contexts from a group."""
    return FreshInferred(
        contexts=contexts_of(dataset),
        relative_se=np.asarray(dataset["relative_se"].to_numpy()),
        inferred=Inferred(ranked_of(dataset), diagnostics_of(dataset)),
        refused=int(dataset.attrs[REFUSED]),
    )
