"""Posteriors under variants of the configuration, the file that holds them, and how far each moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import Variable, build_dataset, from_rows, load, register, schema_of, stacked_values
from swesbi.checks.settings import BASE
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_COLUMNS, PHI_NAMES, THETA_NAMES

FloatArray = NDArray[np.float64]
COLUMNS: Final = (
    "variant", "label", "subject", "parameter", "median", "ci_low", "ci_high", "shift_in_widths",
    "width_ratio", "sampler", "k_hat", "efficiency",
)  # fmt: skip


@dataclass(frozen=True)
class VariantPosterior:
    """Draws (n, 4) of one subject's exact posterior under a variant, and how they were obtained."""

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
    labels = {"subject": [posterior.subject for posterior in posteriors], "parameter": list(PHI_NAMES)}
    return build_dataset(SCHEMA, stacked_values(posteriors)["/"], labels)


def read_posteriors(path: Path) -> tuple[VariantPosterior, ...]:
    """Read the posteriors of one variant.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    dataset = load(path, KIND)[0]
    names = [str(name) for name in dataset["subject"].to_numpy()]
    return tuple(from_rows(VariantPosterior, dataset, "subject", subject=names))


def sensitivity_table(
    variants: Mapping[str, Sequence[VariantPosterior]], labels: Mapping[str, str], mass: float
) -> pd.DataFrame:
    """Return one row a variant, subject and parameter, the base first.

    ``shift_in_widths`` is the move of the median from the base's, in widths of the base's interval;
    ``width_ratio`` the width of the interval over the base's.

    Args:
        variants: Posteriors of every subject by variant; the base is called ``base``.
        labels: What each variant is called.
        mass: Mass of the equal-tailed intervals.
    """
    base = {posterior.subject: posterior for posterior in variants[BASE]}
    rows = [
        row
        for name, parts in variants.items()
        for posterior in parts
        for row in _rows(name, labels[name], posterior, base[posterior.subject], mass)
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _rows(
    variant: str, label: str, posterior: VariantPosterior, base: VariantPosterior, mass: float
) -> list[dict[str, Any]]:
    quantiles, reference = _quantiles(posterior.phi, mass), _quantiles(base.phi, mass)
    return [
        {
            "variant": variant,
            "label": label,
            "subject": posterior.subject,
            "parameter": name,
            "median": quantiles[1, j],
            "ci_low": quantiles[0, j],
            "ci_high": quantiles[2, j],
            "shift_in_widths": (quantiles[1, j] - reference[1, j]) / (reference[2, j] - reference[0, j]),
            "width_ratio": (quantiles[2, j] - quantiles[0, j]) / (reference[2, j] - reference[0, j]),
            "sampler": posterior.sampler,
            "k_hat": posterior.k_hat,
            "efficiency": posterior.efficiency,
        }
        for j, name in enumerate(THETA_NAMES)
    ]


def _quantiles(phi: FloatArray, mass: float) -> FloatArray:
    return np.stack(median_and_interval(phi, mass))
