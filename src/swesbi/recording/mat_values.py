"""What a .mat file may hold of a recording: vectors of numbers, and vectors of short texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64] | NDArray[np.str_]
Group = TypeVar("Group")

NUMBERS: Final = "save it as a real vector of numbers"
TEXTS: Final = "save texts as a cell array, numbers as a vector"
VECTOR: Final = "save one value per attempted sample, as a vector"
NO_TABLE: Final = "convert a table by s = table2struct(T, 'ToScalar', true) and strings by cellstr(...)"
DAMAGED: Final = "cannot be read as a .mat file"
SAVE_AGAIN: Final = "save it again, by save('ID.mat', '-struct', 's'), or give a CSV file"


class MatValueError(ValueError):
    """A variable that no recording can be read from.

    Attributes:
        name: Its name; None where the whole file is meant.
        reason: What is wrong.
        remedy: What to do.
    """

    def __init__(self, name: str | None, reason: str, remedy: str) -> None:
        self.name, self.reason, self.remedy = name, reason, remedy
        super().__init__(f"{name}: {reason}; {remedy}")


def check_shape(name: str, shape: Sequence[int]) -> None:
    """Refuse an array with more than one dimension longer than 1.

    Raises:
        MatValueError: It is a matrix.
    """
    if 0 not in shape and sum(size != 1 for size in shape) > 1:
        raise MatValueError(name, f"is an array of {' x '.join(map(str, shape))}", VECTOR)


def choose(
    variables: Mapping[str, Group], fields: Mapping[str, Sequence[str]], names: Sequence[str]
) -> Group | None:
    """Return the struct that holds the recording, or None where top-level variables do.

    Args:
        variables: The structs of the file by name.
        fields: The names of the top-level variables under "", and of each struct's fields under its name.
        names: The columns of a recording.

    Raises:
        MatValueError: More than one struct has columns of a recording.
    """
    if set(fields[""]) & set(names):
        return None
    holding = [name for name in variables if set(fields[name]) & set(names)]
    if len(holding) > 1:
        raise MatValueError(
            None, f"holds several recordings ({', '.join(holding)})", "save one struct a file"
        )
    return variables[holding[0]] if holding else None
