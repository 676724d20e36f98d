"""The nulls of a population as ``null.h5``, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import xarray as xr

from swesbi.artefacts import (
    Labels,
    build_dataset,
    from_dataset,
    labels_of,
    load,
    register,
    schema_of,
    values_of,
)
from swesbi.context import Context
from swesbi.misspecification.bounds import BOUNDS
from swesbi.misspecification.checks import DISTANCES
from swesbi.parameters import PHI_NAMES
from swesbi.population.null import PopulationNull
from swesbi.recording.dataset import context_values, contexts_of

ALONG: Final = "recording"
SCHEMA: Final = schema_of(Context, ALONG)["/"] | schema_of(PopulationNull)["/"]
LABELS: Final[dict[str, Any]] = {
    "distance": list(DISTANCES),
    "parameter": list(PHI_NAMES),
    "bound": list(BOUNDS),
}
KIND: Final = register(
    "population_null", {"/": SCHEMA}, (*LABELS, *labels_of(PopulationNull), Labels(ALONG, "subject"))
)


def to_dataset(null: PopulationNull) -> xr.Dataset:
    """Return the null recordings as a dataset with dimension recording."""
    labels = {
        "subject": (ALONG, [one.subject for one in null.contexts]),
        "distance": LABELS["distance"],
        "feature": list(null.pooled.feature_names),
    }
    return build_dataset(SCHEMA, values_of(null)["/"] | context_values(null.contexts), labels | LABELS)


def read_null(path: Path) -> PopulationNull:
    """Read the null recordings with their contexts.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    dataset, _ = load(path, KIND)
    return from_dataset(PopulationNull, dataset, contexts=contexts_of(dataset, ALONG))
