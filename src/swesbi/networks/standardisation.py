"""Pooled standardisation of features and context (paper, Sec. 2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray

MIXED: Final = "as listed in component_unit"
RELATIVE_CONSTANT = 1e-10


@dataclass(frozen=True)
class Standardisation:
    """Mean and scale of each component, of shape (C,), in the component's unit."""

    mean: Annotated[FloatArray, Variable("component", MIXED, "pooled mean, of the raw component")]
    scale: Annotated[FloatArray, Variable("component", MIXED, "pooled standard deviation; 1 where constant")]

    def apply(self, values: FloatArray) -> FloatArray:
        """Return (values - mean) / scale for values of shape (..., C)."""
        return np.asarray((values - self.mean) / self.scale)


def fit_standardisation(values: FloatArray) -> Standardisation:
    """Take mean and population standard deviation over the rows of values, shape (N, C).

    A component that is constant over the pool (the sex of an all-male cohort, say) carries no
    information and has no scale: its scale is set to 1 unit, so it becomes zero.
    """
    mean = values.mean(axis=0)
    scale = values.std(axis=0)
    constant = scale <= RELATIVE_CONSTANT * np.maximum(np.abs(mean), 1.0)
    return Standardisation(mean, np.where(constant, 1.0, scale))
