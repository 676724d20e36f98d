"""MATLAB files of versions 4 to 7, through SciPy."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque

from swesbi.recording.mat_values import (
    DAMAGED,
    NO_TABLE,
    SAVE_AGAIN,
    MatValueError,
    Vector,
    choose,
    numbers,
    vector,
)

OBJECTS: Final = (MatlabOpaque, MatlabObject, MatlabFunction)


def read_mat_v5(path: Path, names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that the file holds, from its variables or from one struct.

    Raises:
        MatValueError: The file is damaged, or a variable is neither numbers nor texts.
    """
    variables = _load(path)
    structs = {name: value for name, value in variables.items() if value.dtype.names and value.size == 1}
    fields = {name: tuple(value.dtype.names or ()) for name, value in structs.items()} | {
        "": tuple(variables)
    }
    chosen = choose(structs, fields, names)
    if chosen is not None:
        variables = {name: chosen.ravel()[0][name] for name in chosen.dtype.names or ()}
    found = {name: _vector(name, variables[name]) for name in names if name in variables}
    if not found and any(isinstance(value, OBJECTS) for value in variables.values()):
        raise MatValueError(None, "holds a table or another MATLAB object", NO_TABLE)
    return found


def _load(path: Path) -> dict[str, NDArray[Any]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            variables = loadmat(path, appendmat=False)
    # SciPy's reader has no error of its own: what a damaged file raises is an accident of where the damage is
    except Exception as error:
        raise MatValueError(None, f"{DAMAGED} ({type(error).__name__}: {error})", SAVE_AGAIN) from error
    return {name: np.asanyarray(value) for name, value in variables.items() if not str(name).startswith("__")}


def _vector(name: str, value: NDArray[Any]) -> Vector:
    if isinstance(value, OBJECTS):
        raise MatValueError(name, "is a MATLAB object, not plain values", NO_TABLE)
    if value.dtype.kind == "U":
        return vector(name, value)
    if value.dtype.kind == "O":
        return np.array([_text(name, cell) for cell in vector(name, value)], dtype=np.str_)
    return numbers(name, value)


def _text(name: str, cell: object) -> str:
    """Return the text of one cell of a cell array; an empty cell is an empty text."""
    value = np.asanyarray(cell)
    if value.size == 0:
        return ""
    if value.dtype.kind != "U" or value.size != 1:
        raise MatValueError(
            name, "has a cell that is no text", "save texts as a cell array, numbers as a vector"
        )
    return str(value.ravel()[0])
