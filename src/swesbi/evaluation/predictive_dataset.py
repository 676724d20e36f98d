"""Predictive checks as HDF5 artefacts: dataclass to datasets and back."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import xarray as xr

from swesbi.artefacts import Provenance, from_groups, labels_of, load, register, schema_of, to_groups
from swesbi.evaluation.predictive import PredictiveCheck
from swesbi.parameters import THETA_NAMES

SCHEMA: Final = schema_of(PredictiveCheck)
KIND: Final = register("predictive", SCHEMA, (*labels_of(PredictiveCheck), "parameter"))


def to_datasets(check: PredictiveCheck) -> dict[str, xr.Dataset]:
    """Return the root, prior and posterior groups of a predictive artefact."""
    return to_groups(check, {"parameter": list(THETA_NAMES)})


def read_predictive(path: Path) -> tuple[PredictiveCheck, Provenance]:
    """Read a predictive artefact.

    Raises:
        ArtefactError: The file is no predictive artefact of this schema version.
    """
    groups = {group: load(path, KIND, group)[0] for group in SCHEMA}
    observed = groups["/"]["features"].to_numpy()
    given = {f"{group}.features.observed": observed for group in ("prior", "posterior")}
    return from_groups(PredictiveCheck, groups, given), load(path, KIND)[1]
