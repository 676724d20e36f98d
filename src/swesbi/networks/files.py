"""What files of networks share: statistics of inputs, and numbers checked before a net is made of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Self

import numpy as np

from swesbi.artefacts import Artefact, DamagedArtefactError, Group, Variable
from swesbi.artefacts.files import UNREADABLE
from swesbi.base.arrays import FloatArray

MIXED: Final = "as listed in component_unit"
RELATIVE_CONSTANT: Final = 1e-10
LOSS: Final = "validation_loss"
"""Ends the names of what need not be finite: a network may do without it."""


class NetworkFile(Artefact):
    """A file of a trained network, which is refused unless its numbers make up the net that it declares."""

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a network.

        Raises:
            DamagedArtefactError: A number is not finite, or an array has not the size that the net needs.
        """
        groups, made = cls.load(path)
        try:
            check_numbers(groups["/"])
            return cls.rebuilt(groups, made)
        except UNREADABLE as error:
            raise DamagedArtefactError(path, str(error)) from error


def check_numbers(stored: Group) -> None:
    """Raise a ValueError where a number is not finite, or arrays along one dimension differ in length."""
    lengths: dict[str, int] = {}
    for name, array in stored.items():
        for dimension, length in array.sizes.items():
            if length != lengths.setdefault(dimension, length):
                raise ValueError(
                    f"{name!r} has {length} values along {dimension!r}, others have {lengths[dimension]}"
                )
        is_number = array.values.dtype.kind == "f" and not name.endswith(LOSS)
        if is_number and not np.isfinite(array.values).all():
            raise ValueError(f"{name!r} holds numbers that are not finite")


@dataclass(frozen=True)
class Standardisation:
    """Mean and scale of each component, of shape (C,), in the component's unit (paper, Sec. 2.3)."""

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
