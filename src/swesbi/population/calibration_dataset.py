"""Calibration on fresh contexts as datasets, and back; parts and whole have the same groups."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import xarray as xr

from swesbi.artefacts import build_dataset, from_dataset, load, register, schema_of, values_of
from swesbi.calibration.dataset import REQUIRED, inferred_dataset
from swesbi.calibration.ranked import Inferred
from swesbi.context import Context
from swesbi.population.calibration import FreshInferred
from swesbi.population.recordings import ACQUIRED, OWN
from swesbi.recording.dataset import context_values, contexts_of

ALONG: Final = "recording"
OF_FRESH: Final = schema_of(Context, ALONG)["/"] | schema_of(FreshInferred)["/"]
SCHEMA: Final = schema_of(Inferred)["/"] | OF_FRESH
KIND: Final = register("population_calibration", {OWN: SCHEMA, ACQUIRED: SCHEMA}, REQUIRED)
REFUSED: Final = "refused"


def fresh_dataset(found: FreshInferred) -> xr.Dataset:
    """Return the recordings of fresh contexts as one group."""
    added = build_dataset(OF_FRESH, values_of(found)["/"] | context_values(found.contexts))
    inferred = inferred_dataset(found.inferred)
    return inferred.assign(added.variables).assign_attrs({REFUSED: found.refused})


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
    given = {"contexts": contexts_of(dataset, ALONG), "inferred": from_dataset(Inferred, dataset)}
    return from_dataset(FreshInferred, dataset, refused=int(dataset.attrs[REFUSED]), **given)
