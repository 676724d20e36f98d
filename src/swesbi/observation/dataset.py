"""The passive baseline as an artefact: dataclass to dataset and back."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.observation import SCHEMAS
from swesbi.observation.passive import PassiveBaseline

KIND = "passive"
SCHEMA = SCHEMAS[KIND]["/"]


def to_dataset(passive: PassiveBaseline) -> xr.Dataset:
    """Return the passive baseline as a dataset with the dimension cycle."""
    values = {name: getattr(passive, name) for name in SCHEMA}
    return build_dataset(SCHEMA, values)


def read_passive(path: Path) -> PassiveBaseline:
    """Read the passive baseline of one subject.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    dataset, _ = load(path, KIND)
    values: dict[str, Any] = {
        field.name: dataset[field.name].to_numpy()[()] for field in fields(PassiveBaseline)
    }
    return PassiveBaseline(**values)
