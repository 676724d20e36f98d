"""CMA-ES fits as HDF5 artefacts: dataclass to dataset and back."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import xarray as xr

from swesbi.artefacts import Provenance, from_dataset, labels_of, load, register, schema_of
from swesbi.artefacts import to_dataset as stored
from swesbi.evaluation.fit import CmaesFit
from swesbi.parameters import THETA_NAMES

KIND: Final = register("cmaes", schema_of(CmaesFit), ("parameter", *labels_of(CmaesFit)))


def to_dataset(fit: CmaesFit) -> xr.Dataset:
    """Return a CMA-ES fit as the root group of its artefact."""
    return stored(fit, {"parameter": list(THETA_NAMES)})


def read_cmaes(path: Path) -> tuple[CmaesFit, Provenance]:
    """Read a CMA-ES artefact.

    Raises:
        ArtefactError: The file is no CMA-ES artefact of this schema version.
    """
    root, provenance = load(path, KIND)
    return from_dataset(CmaesFit, root), provenance
