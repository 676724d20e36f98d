"""How far medians and intervals move, against the width of the interval that they move from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.intervals import median_and_interval
from swesbi.parameters import THETA_NAMES
from swesbi.sensitivity.posteriors import VariantPosterior
from swesbi.sensitivity.settings import BASE

FloatArray = NDArray[np.float64]
COLUMNS: Final = (
    "variant",
    "label",
    "subject",
    "parameter",
    "median",
    "ci_low",
    "ci_high",
    "shift_in_widths",
    "width_ratio",
    "sampler",
    "k_hat",
    "efficiency",
)


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
    base = {part.subject: part for part in variants[BASE]}
    rows = [
        row
        for name, parts in variants.items()
        for part in parts
        for row in _rows(name, labels[name], part, base[part.subject], mass)
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _rows(
    variant: str, label: str, part: VariantPosterior, base: VariantPosterior, mass: float
) -> list[dict[str, Any]]:
    own, reference = _quantiles(part.phi, mass), _quantiles(base.phi, mass)
    return [
        {
            "variant": variant,
            "label": label,
            "subject": part.subject,
            "parameter": name,
            "median": own[1, j],
            "ci_low": own[0, j],
            "ci_high": own[2, j],
            "shift_in_widths": (own[1, j] - reference[1, j]) / (reference[2, j] - reference[0, j]),
            "width_ratio": (own[2, j] - own[0, j]) / (reference[2, j] - reference[0, j]),
            "sampler": part.sampler,
            "k_hat": part.k_hat,
            "efficiency": part.efficiency,
        }
        for j, name in enumerate(THETA_NAMES)
    ]


def _quantiles(phi: FloatArray, mass: float) -> FloatArray:
    return np.stack(median_and_interval(phi, mass))
