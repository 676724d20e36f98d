"""The posteriors of one variant as an artefact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import Variable, build_dataset, from_rows, load, register, schema_of, stacked_values
from swesbi.parameters import PHI_COLUMNS, PHI_NAMES

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class VariantPosterior:
    """Draws (n, 4) of one subject's exact posterior under a variant, and how they were come by."""

    subject: str
    phi: Annotated[FloatArray, Variable("draw parameter", PHI_COLUMNS, "exact posterior draws")]
    by_mcmc: Annotated[bool, Variable("", "1", "1 by MCMC, 0 by importance weights")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    converged: Annotated[bool, Variable("", "1", "1 where the draws are reliable")]

    @property
    def sampler(self) -> str:
        """What gave the draws: ``mcmc`` or ``importance``."""
        return "mcmc" if self.by_mcmc else "importance"


SCHEMA: Final = schema_of(VariantPosterior, along="subject")["/"]
KIND: Final = register("sensitivity", {"/": SCHEMA}, ("subject", "parameter"))


def to_dataset(posteriors: Sequence[VariantPosterior]) -> xr.Dataset:
    """Return the posteriors of all subjects with dimensions subject, draw and parameter."""
    labels = {"subject": [part.subject for part in posteriors], "parameter": list(PHI_NAMES)}
    return build_dataset(SCHEMA, stacked_values(posteriors)["/"], labels)


def read_posteriors(path: Path) -> tuple[VariantPosterior, ...]:
    """Read the posteriors of one variant.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    dataset = load(path, KIND)[0]
    names = [str(name) for name in dataset["subject"].to_numpy()]
    return tuple(from_rows(VariantPosterior, dataset, "subject", subject=names))
