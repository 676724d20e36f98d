"""Recordings in MATLAB files of versions 5 to 7."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.recording import mat_elements as mat
from swesbi.recording.mat_elements import Matrix, damaged, read_variables
from swesbi.recording.mat_values import (
    NO_TABLE,
    NUMBERS,
    TEXTS,
    MatValueError,
    Vector,
    check_shape,
    choose,
)

OBJECTS: Final = frozenset({mat.OBJECT, mat.FUNCTION, mat.OPAQUE})


def read_mat_v5(path: Path, names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that the file holds, from its variables or from one struct.

    Raises:
        MatValueError: The file is damaged, or a variable is neither numbers nor texts.
    """
    variables = {matrix.name: matrix for matrix in read_variables(path)}
    structs = {
        name: _fields(matrix)
        for name, matrix in variables.items()
        if matrix.kind == mat.STRUCT and matrix.size == 1
    }
    fields = {name: tuple(members) for name, members in structs.items()} | {"": tuple(variables)}
    members = choose(structs, fields, names) or variables
    found = {name: _vector(name, members[name]) for name in names if name in members}
    if not found and any(matrix.kind in OBJECTS for matrix in variables.values()):
        raise MatValueError(None, "holds a table or another MATLAB object", NO_TABLE)
    return found


def _fields(matrix: Matrix) -> Mapping[str, Matrix]:
    """Return the members of a struct: after its dimensions come the width of a name, and all names."""
    if len(matrix.parts) < 2:
        raise damaged(f"the struct {matrix.name} without names")
    width, text = mat.integers(matrix.parts[0], matrix.order), matrix.parts[1][1]
    if len(width) != 1 or width[0] < 1:
        raise damaged(f"the struct {matrix.name} with names of no width")
    names = [
        text[start : start + width[0]].split(b"\0")[0].decode("latin-1")
        for start in range(0, len(text), width[0])
    ]
    children = matrix.children()
    if len(children) != len(names):
        raise damaged(f"the struct {matrix.name} with {len(names)} names and {len(children)} values")
    return dict(zip(names, children, strict=True))


def _vector(name: str, matrix: Matrix) -> Vector:
    if matrix.kind in OBJECTS:
        raise MatValueError(name, "is a MATLAB object, not plain values", NO_TABLE)
    if matrix.kind == mat.CELL:
        check_shape(name, matrix.shape)
        return np.array([_text(name, cell) for cell in matrix.children()], dtype=np.str_)
    if matrix.kind == mat.CHAR:
        return np.array(_rows(name, matrix), dtype=np.str_)
    if matrix.kind in {mat.STRUCT, mat.SPARSE} or matrix.imaginary:
        what = {mat.STRUCT: "a struct", mat.SPARSE: "a sparse matrix"}.get(matrix.kind, "complex")
        raise MatValueError(name, f"is {what}", NUMBERS)
    check_shape(name, matrix.shape)
    numbers = mat.values(matrix.parts[0], matrix.order) if matrix.parts else np.empty(0)
    if numbers.size != matrix.size:
        raise damaged(f"{name} with {numbers.size} of {matrix.size} values")
    return numbers.astype(np.float64)


def _text(name: str, cell: Matrix) -> str:
    """Return the text of one cell; an empty cell is an empty text."""
    if cell.size == 0:
        return ""
    texts = _rows(name, cell) if cell.kind == mat.CHAR else []
    if len(texts) != 1:
        raise MatValueError(name, "has a cell that is no text", TEXTS)
    return texts[0]


def _rows(name: str, matrix: Matrix) -> list[str]:
    """Return the rows of a char matrix, which is stored column by column."""
    text = mat.characters(matrix.parts[0], matrix.order) if matrix.parts else ""
    if len(matrix.shape) != 2 or len(text) != matrix.size:
        raise damaged(f"{name} with {len(text)} of {matrix.size} characters")
    rows = matrix.shape[0]
    return [text[start::rows].rstrip() for start in range(rows)]
