"""Arrays by what they hold; the docstrings that name them say their shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Arrays = TypeVar("Arrays", bound="DataclassInstance")
"""A dataclass of arrays with one row each, and of such dataclasses."""

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
TextArray = NDArray[np.object_]  # of texts of any length


def below_each_other(parts: Sequence[Arrays]) -> Arrays:
    """Return the rows of several, at least one; what is no array is that of the first."""
    return _changed(parts, np.concatenate)


def rows_of(whole: Arrays, chosen: BoolArray | IntArray) -> Arrays:
    """Return some of the rows, by truth values (n,) or by their numbers."""
    return _changed([whole], lambda values: values[0][chosen])


def _changed(parts: Sequence[Arrays], change: Callable[[list[Any]], Any]) -> Arrays:
    changed: dict[str, Any] = {}
    for name in (field.name for field in fields(parts[0])):
        values = [getattr(part, name) for part in parts]
        if is_dataclass(values[0]):
            changed[name] = _changed(values, change)
        elif isinstance(values[0], np.ndarray):
            changed[name] = change(values)
    return replace(parts[0], **changed)
