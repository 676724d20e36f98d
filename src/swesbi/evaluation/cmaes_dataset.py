"""CMA-ES fits as HDF5 artefacts: dataclass to dataset and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray as xr

from swesbi.artefacts import Provenance, build_dataset, load
from swesbi.artefacts.kinds.evaluation import SCHEMAS
from swesbi.evaluation.fit import CmaesFit
from swesbi.parameters import THETA_NAMES

KIND = "cmaes"
SCHEMA = SCHEMAS[KIND]


def to_dataset(fit: CmaesFit) -> xr.Dataset:
    """Return a CMA-ES fit as the root group of its artefact."""
    values = {name: getattr(fit, name) for name in SCHEMA["/"]}
    labels = {"parameter": list(THETA_NAMES), "stop": ("run", list(fit.stop))}
    return build_dataset(SCHEMA["/"], values, labels)


def read_cmaes(path: Path) -> tuple[CmaesFit, Provenance]:
    """Read a CMA-ES artefact.

    Raises:
        ArtefactError: The file is no CMA-ES artefact of this schema version.
    """
    root, provenance = load(path, KIND)
    values: dict[str, Any] = {name: root[name].to_numpy()[()] for name in SCHEMA["/"]}
    return CmaesFit(**values, stop=tuple(map(str, root["stop"].to_numpy()))), provenance
