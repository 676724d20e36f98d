"""The cohort's noise as an artefact: dataclass to dataset and back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.noise import SCHEMAS
from swesbi.noise.cohort import CohortNoise, NoiseEstimate
from swesbi.noise.components import ComponentEstimate

KIND: Final = "noise"
SCHEMA: Final = SCHEMAS[KIND]["/"]
COMPONENTS: Final = ("repeat", "sample")
VALUES: Final = ("fraction", "standard_error", "low", "high")


def to_dataset(noise: CohortNoise) -> xr.Dataset:
    """Return the artefact's content; subjects in the order of the cohort."""
    own = tuple(noise.by_subject.values())
    values: dict[str, Any] = {name: _table((noise.pooled,), name)[0] for name in VALUES}
    values |= {f"subject_{name}": _table(own, name) for name in VALUES}
    values |= {
        "component": list(COMPONENTS),
        "subject": list(noise.by_subject),
        "repeats": noise.pooled.repeats,
        "samples": noise.pooled.samples,
        "subject_repeats": np.array([one.repeats for one in own]),
        "subject_samples": np.array([one.samples for one in own]),
        "interval": noise.interval,
        "homogeneity_p": noise.homogeneity_p,
    }
    return build_dataset(SCHEMA, values)


def read_noise(path: Path) -> CohortNoise:
    """Read the noise of a cohort.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    data, _ = load(path, KIND)
    by_subject = {
        str(name): _estimate(data.isel(subject=index), "subject_")
        for index, name in enumerate(data["subject"].to_numpy())
    }
    return CohortNoise(
        pooled=_estimate(data, ""),
        by_subject=by_subject,
        interval=data["interval"].item(),
        homogeneity_p=data["homogeneity_p"].item(),
    )


def _table(estimates: Sequence[NoiseEstimate], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([[getattr(getattr(one, part), name) for part in COMPONENTS] for one in estimates])


def _estimate(data: xr.Dataset, prefix: str) -> NoiseEstimate:
    repeat, sample = (
        ComponentEstimate(**{name: data[prefix + name].to_numpy()[index].item() for name in VALUES})
        for index in range(len(COMPONENTS))
    )
    return NoiseEstimate(repeat, sample, data[f"{prefix}repeats"].item(), data[f"{prefix}samples"].item())
