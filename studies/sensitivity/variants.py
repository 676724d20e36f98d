"""Posteriors under variants of the configuration, the file that holds them, and how far each moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import (
    Artefact,
    Group,
    Labels,
    Provenance,
    Variable,
    build_group,
    from_rows,
    schema_of,
    stacked_values,
)
from swesbi.artefacts.schema import Schema
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


@dataclass(frozen=True)
class VariantPosteriors(Artefact, kind="sensitivity"):
    """The posteriors of all subjects under one variant."""

    of: tuple[VariantPosterior, ...]

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the names of the subjects and of the parameters."""
        return (Labels("subject"), Labels("parameter"))

    def to_groups(self) -> dict[str, Group]:
        """Return the content of the file, with dimensions subject, draw and parameter."""
        labels = {"subject": [posterior.subject for posterior in self.of], "parameter": list(PHI_NAMES)}
        return {"/": build_group(SCHEMA, stacked_values(self.of)["/"], labels)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> VariantPosteriors:
        """Return what the group of a file holds."""
        names = [str(name) for name in groups["/"]["subject"].to_numpy()]
        return cls(tuple(from_rows(VariantPosterior, groups["/"], "subject", subject=names)))


def sensitivity_table(
    variants: Mapping[str, Sequence[VariantPosterior]], labels: Mapping[str, str], mass: float
) -> pd.DataFrame:
    """Return one row a variant, subject and parameter; the variant ``base`` comes first.

    ``shift_in_widths`` is the move of the median from the base's, in widths of the base's equal-tailed
    interval; ``width_ratio`` the width of the interval over the base's.
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
    quantiles, reference = (np.stack(median_and_interval(each.phi, mass)) for each in (posterior, base))
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
