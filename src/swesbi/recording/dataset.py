"""The observed curve as an artefact: dataclass to datasets and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.recording import SCHEMAS
from swesbi.context import Context
from swesbi.recording.observation import Observation
from swesbi.recording.quality import REASONS
from swesbi.recording.speed import NoiseComponents

KIND = "observation"
SCHEMA = SCHEMAS[KIND]
ARRAYS = (
    "phase",
    "phase_index",
    "speed_m_s",
    "speed_se_m_s",
    "stiffness_kpa",
    "stiffness_se_kpa",
    "grid",
    "curve_kpa",
    "samples_accepted",
    "samples_by_repeat",
    "samples_rejected",
)
NOISE = {"repeat_noise_fraction": "repeat_fraction", "sample_noise_fraction": "sample_fraction"}


def to_datasets(observation: Observation) -> dict[str, xr.Dataset]:
    """Return the groups of the artefact: the curve at the root, the context beside it."""
    values: dict[str, Any] = {name: getattr(observation, name, None) for name in SCHEMA["/"]}
    values |= {name: getattr(observation.noise, field) for name, field in NOISE.items()}
    values |= {"measured": observation.measured.astype(np.int8), "reason": list(REASONS)}
    context = {name: getattr(observation.context, name) for name in SCHEMA["context"]}
    return {"/": build_dataset(SCHEMA["/"], values), "context": build_dataset(SCHEMA["context"], context)}


def read_observation(path: Path) -> Observation:
    """Read the observed curve of one subject.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, provenance = load(path, KIND)
    context, _ = load(path, KIND, "context")
    return Observation(
        context=Context(
            subject=provenance.subject, **{name: context[name].item() for name in SCHEMA["context"]}
        ),
        measured=root["measured"].to_numpy().astype(np.bool_),
        noise=NoiseComponents(**{field: root[name].item() for name, field in NOISE.items()}),
        **{name: root[name].to_numpy() for name in ARRAYS},
    )
