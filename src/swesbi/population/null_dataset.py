"""The nulls of a population as ``null.h5``, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.population import SCHEMAS
from swesbi.misspecification.bounds import BOUNDS
from swesbi.misspecification.checks import DISTANCES, Checks
from swesbi.misspecification.pooled import PooledNull
from swesbi.parameters import PHI_NAMES
from swesbi.population.context_dataset import context_values, contexts_of
from swesbi.population.null import PopulationNull

KIND: Final = "population_null"
CHECKS: Final = tuple(Checks.__dataclass_fields__)


def to_dataset(null: PopulationNull) -> xr.Dataset:
    """Return the null recordings as a dataset with dimension recording."""
    pooled = null.pooled
    values: dict[str, Any] = {name: getattr(pooled.checks, name) for name in CHECKS}
    values |= {"distance_level": pooled.distance_level, "prior_strip_mass": pooled.prior_mass}
    labels = {
        "subject": ("recording", [one.subject for one in null.contexts]),
        "distance": list(DISTANCES),
        "feature": list(pooled.feature_names),
        "parameter": list(PHI_NAMES),
        "bound": list(BOUNDS),
    }
    return build_dataset(SCHEMAS[KIND]["/"], values | context_values(null.contexts), labels)


def read_null(path: Path) -> PopulationNull:
    """Read the null recordings with their contexts.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    dataset, _ = load(path, KIND)
    pooled = PooledNull(
        checks=Checks(**{name: dataset[name].to_numpy() for name in CHECKS}),
        distance_level=dataset["distance_level"].to_numpy(),
        feature_names=tuple(map(str, dataset["feature"].to_numpy())),
        prior_mass=dataset["prior_strip_mass"].to_numpy(),
    )
    return PopulationNull(contexts_of(dataset), pooled)
