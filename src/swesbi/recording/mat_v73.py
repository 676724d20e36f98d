"""MATLAB files of version 7.3, which are HDF5 files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from swesbi.recording.mat_values import (
    DAMAGED,
    NO_TABLE,
    NUMBERS,
    SAVE_AGAIN,
    TEXTS,
    MatValueError,
    Vector,
    check_shape,
    choose,
)

MAX_VALUES: Final = 5_000_000
CLASS: Final = "MATLAB_class"
NUMERIC: Final = frozenset(
    {"double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}
)


def read_mat_v73(path: Path, names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that the file holds, from its variables or from one struct.

    Raises:
        MatValueError: The file is damaged, or a variable is neither numbers nor texts, or lies elsewhere.
    """
    try:
        with h5py.File(path, "r") as file:
            return _read(file, names)
    except MatValueError:
        raise
    # h5py passes on whatever its library says of a damaged file, under many types
    except Exception as error:
        raise MatValueError(None, f"{DAMAGED} ({type(error).__name__}: {error})", SAVE_AGAIN) from error


def _read(file: h5py.File, names: Sequence[str]) -> dict[str, Vector]:
    variables = _members(file)
    structs = {name: item for name, item in variables.items() if isinstance(item, h5py.Group)}
    fields = {name: tuple(item) for name, item in structs.items()} | {"": tuple(variables)}
    chosen = choose(structs, fields, names)
    members = variables if chosen is None else _members(chosen)
    found = {name: _vector(name, members[name]) for name in names if name in members}
    if not found and "#subsystem#" in file:
        raise MatValueError(None, "holds a table or another MATLAB object", NO_TABLE)
    return found


def _members(group: h5py.Group) -> Mapping[str, h5py.Dataset | h5py.Group]:
    """Return what lies in a group itself; a link to elsewhere, another file even, is refused."""
    members = {}
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise MatValueError(name, "is a link, not a variable", SAVE_AGAIN)
        if not name.startswith("#"):
            members[name] = group[name]
    return members


def _vector(name: str, item: h5py.Dataset | h5py.Group) -> Vector:
    if not isinstance(item, h5py.Dataset):
        raise MatValueError(name, "is a struct", NUMBERS)
    kind = _kind(item)
    _check_plain(name, item)
    if item.attrs.get("MATLAB_empty", 0):
        return np.empty(0)
    if kind == "char":
        return np.array(_characters(name, item[()]), dtype=np.str_)
    check_shape(name, item.shape)
    if kind == "cell":
        cells = np.asarray(item[()]).ravel()
        return np.array([_cell(name, item.file, cell) for cell in cells], dtype=np.str_)
    if kind not in NUMERIC:
        raise MatValueError(name, f"is of class {kind!r}", NO_TABLE)
    if item.dtype.kind not in "biuf":
        raise MatValueError(name, "is complex", NUMBERS)
    return np.asarray(item[()]).ravel().astype(np.float64)


def _kind(item: h5py.Dataset) -> str:
    kind = item.attrs.get(CLASS, b"double")
    return kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)


def _check_plain(name: str, item: h5py.Dataset) -> None:
    if item.external or item.is_virtual:
        raise MatValueError(name, "keeps its values in another file", SAVE_AGAIN)
    if item.size is None or item.size > MAX_VALUES:
        reason = f"has {item.size} values, the limit is {MAX_VALUES}"
        raise MatValueError(name, reason, "keep one value per attempted sample, no images or raw data")


def _cell(name: str, file: h5py.File, reference: object) -> str:
    """Return the text that a cell refers to; an empty cell is an empty text."""
    if not isinstance(reference, h5py.Reference):
        raise MatValueError(name, "has a cell that refers to nothing", SAVE_AGAIN)
    item = file[reference]
    if not isinstance(item, h5py.Dataset) or _kind(item) != "char":
        raise MatValueError(name, "has a cell that is no text", TEXTS)
    _check_plain(name, item)
    if item.attrs.get("MATLAB_empty", 0):
        return ""
    texts = _characters(name, item[()])
    if len(texts) != 1:
        raise MatValueError(name, "has a cell of several texts", "save one text a cell")
    return texts[0]


def _characters(name: str, codes: NDArray[Any]) -> list[str]:
    """Return the rows of a char matrix, stored as UTF-16 codes, column by column."""
    if codes.ndim != 2 or codes.dtype.kind != "u":
        raise MatValueError(name, "holds no readable text", TEXTS)
    rows = codes.T.astype("<u2")
    return [row.tobytes().decode("utf-16-le", "replace").rstrip() for row in rows]
