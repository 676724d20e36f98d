"""The posteriors of one variant as an artefact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.sensitivity import SCHEMAS
from swesbi.parameters import PHI_NAMES

FloatArray = NDArray[np.float64]
KIND: Final = "sensitivity"
SCHEMA: Final = SCHEMAS[KIND]["/"]


@dataclass(frozen=True)
class VariantPosterior:
    """Draws (n, 4) of one subject's exact posterior under a variant, and how they were come by."""

    subject: str
    phi: FloatArray
    sampler: str
    k_hat: float
    efficiency: float
    converged: bool


def to_dataset(posteriors: Sequence[VariantPosterior]) -> xr.Dataset:
    """Return the posteriors of all subjects with dimensions subject, draw and parameter."""
    values = {
        "phi": np.stack([part.phi for part in posteriors]),
        "by_mcmc": np.array([part.sampler == "mcmc" for part in posteriors], dtype=np.int8),
        "k_hat": np.array([part.k_hat for part in posteriors]),
        "efficiency": np.array([part.efficiency for part in posteriors]),
        "converged": np.array([part.converged for part in posteriors], dtype=np.int8),
    }
    subjects = [part.subject for part in posteriors]
    return build_dataset(SCHEMA, values, {"subject": subjects, "parameter": list(PHI_NAMES)})


def read_posteriors(path: Path) -> tuple[VariantPosterior, ...]:
    """Read the posteriors of one variant.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    dataset = load(path, KIND)[0]
    return tuple(_subject(dataset.sel(subject=name), str(name)) for name in dataset["subject"].to_numpy())


def _subject(own: xr.Dataset, name: str) -> VariantPosterior:
    return VariantPosterior(
        subject=name,
        phi=own["phi"].to_numpy(),
        sampler="mcmc" if own["by_mcmc"].item() else "importance",
        k_hat=own["k_hat"].item(),
        efficiency=own["efficiency"].item(),
        converged=bool(own["converged"].item()),
    )
