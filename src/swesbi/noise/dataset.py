"""The cohort's noise as an artefact: dataclass to dataset and back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from swesbi.artefacts import (
    Part,
    Variable,
    build_dataset,
    from_dataset,
    from_rows,
    load,
    register,
    schema_of,
    values_of,
)
from swesbi.noise.cohort import CohortNoise, NoiseEstimate
from swesbi.noise.components import ComponentEstimate

COMPONENTS: Final = ("repeat", "sample")
VALUES: Final = schema_of(ComponentEstimate)["/"]
POOLED: Final = Part(
    along="component",
    words={"whose": "common to the cohort", "none": ", NaN at zero", "kind": "profile-likelihood "},
)
OWN: Final = Part(
    "subject_{}", "subject component", words={"whose": "of one recording alone", "none": "", "kind": ""}
)
COUNTS: Final = schema_of(NoiseEstimate)["/"]
SCHEMA: Final = {
    "component": Variable("component", "1", "between repeats, between samples of a repeat"),
    "subject": Variable("subject", "1", "subjects of the cohort"),
    **POOLED.place_all(VALUES),
    **COUNTS,
    **OWN.place_all(VALUES),
    **Part("subject_{}", "subject").place_all(COUNTS),
    **schema_of(CohortNoise)["/"],
}
KIND: Final = register("noise", {"/": SCHEMA})


def to_dataset(noise: CohortNoise) -> xr.Dataset:
    """Return the artefact's content; subjects in the order of the cohort."""
    own = tuple(noise.by_subject.values())
    values: dict[str, Any] = {name: _table((noise.pooled,), name)[0] for name in VALUES}
    values |= {f"subject_{name}": _table(own, name) for name in VALUES}
    values |= {f"subject_{name}": np.array([getattr(one, name) for one in own]) for name in COUNTS}
    values |= {"component": list(COMPONENTS), "subject": list(noise.by_subject)}
    return build_dataset(SCHEMA, values | values_of(noise.pooled)["/"] | values_of(noise)["/"])


def read_noise(path: Path) -> CohortNoise:
    """Read the noise of a cohort.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    data, _ = load(path, KIND)
    names = [name for name in data if str(name).startswith("subject_")]
    own = data[names].rename({name: str(name).removeprefix("subject_") for name in names})
    by_subject = {
        str(name): _estimate(own.isel(subject=index)) for index, name in enumerate(own["subject"].to_numpy())
    }
    return from_dataset(CohortNoise, data, pooled=_estimate(data), by_subject=by_subject)


def _table(estimates: Sequence[NoiseEstimate], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([[getattr(getattr(one, part), name) for part in COMPONENTS] for one in estimates])


def _estimate(data: xr.Dataset) -> NoiseEstimate:
    repeat, sample = from_rows(ComponentEstimate, data, "component")
    return from_dataset(NoiseEstimate, data, repeat=repeat, sample=sample)
