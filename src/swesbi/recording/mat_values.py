"""What a .mat file may hold of a recording: vectors of numbers and of short texts, or one struct of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray

Vector = FloatArray | NDArray[np.str_]
NUMBERS: Final = "save it as a real vector of numbers"
TEXTS: Final = "save texts as a cell array, numbers as a vector"
VECTOR: Final = "save one value per attempted sample, as a vector"
NO_TABLE: Final = "convert a table by s = table2struct(T, 'ToScalar', true) and strings by cellstr(...)"
SAVE_AGAIN: Final = "save it again, by save('ID.mat', '-struct', 's'), or give a CSV file"
REFUSED: Final = {
    "struct": ("is a struct", NUMBERS),
    "sparse": ("is a sparse matrix", NUMBERS),
    "complex": ("is complex", NUMBERS),
    "too large": ("has more values than a recording", "keep one value a sample, no images or raw data"),
    "object": ("is a MATLAB object, not plain values", NO_TABLE),
}


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


def damaged(what: str) -> MatValueError:
    """Return the error of a file that does not follow the format, to be raised."""
    return MatValueError(None, f"cannot be read as a .mat file ({what})", SAVE_AGAIN)


class MatVariable(Protocol):
    """One variable, whatever the version of its file; every method may raise ``MatValueError``."""

    @property
    def name(self) -> str:
        """Its name, or that of the variable that it is a cell of."""

    @property
    def kind(self) -> str:
        """One of "number", "char", "cell", a key of ``REFUSED``, or the name of another class."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Its dimensions."""

    def numbers(self) -> FloatArray:
        """Return its numbers, one after the other."""

    def rows(self) -> list[str]:
        """Return the rows of a char matrix, without the blanks that fill them up."""

    def cells(self) -> Sequence[MatVariable]:
        """Return the cells of a cell array."""

    def fields(self) -> Mapping[str, MatVariable]:
        """Return the fields of a struct; of an array of structs each is a cell array."""


def read_vectors(variables: Mapping[str, MatVariable], names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that a file holds, from its variables or from one struct.

    Raises:
        MatValueError: The file is damaged, holds several recordings, or a variable is neither numbers nor
            texts.
    """
    members = _members(variables, names)
    vectors = {name: _vector(members[name]) for name in names if name in members}
    if not vectors and any(variable.kind == "object" for variable in variables.values()):
        raise MatValueError(None, "holds a table or another MATLAB object", NO_TABLE)
    return vectors


def _members(variables: Mapping[str, MatVariable], names: Sequence[str]) -> Mapping[str, MatVariable]:
    """Return the variables, or in their place the fields of the one struct that holds the recording."""
    structs = {name: item.fields() for name, item in variables.items() if item.kind == "struct"}
    holding = [name for name, fields in structs.items() if set(fields) & set(names)]
    if set(variables) & set(names) or not holding:
        return variables
    if len(holding) > 1:
        reason = f"holds several recordings ({', '.join(holding)})"
        raise MatValueError(None, reason, "save one struct a file")
    return structs[holding[0]]


def _vector(variable: MatVariable) -> Vector:
    kind, shape = variable.kind, variable.shape
    if kind == "char":
        return np.array(variable.rows(), dtype=np.str_)
    if kind not in {"cell", "number"}:
        reason, remedy = REFUSED.get(kind, (f"is of class {kind!r}", NO_TABLE))
        raise MatValueError(variable.name, reason, remedy)
    if 0 not in shape and sum(size != 1 for size in shape) > 1:
        raise MatValueError(variable.name, f"is an array of {' x '.join(map(str, shape))}", VECTOR)
    if kind == "number":
        return variable.numbers()
    cells = variable.cells()
    if cells and all(cell.kind == "number" and math.prod(cell.shape) <= 1 for cell in cells):
        return np.array(
            [value for cell in cells for value in (cell.numbers() if cell.numbers().size else [np.nan])]
        )
    return np.array([_text(cell) for cell in cells], np.str_)


def _text(cell: MatVariable) -> str:
    """Return the text of one cell; an empty cell is an empty text."""
    if math.prod(cell.shape) == 0:
        return ""
    if cell.kind != "char":
        raise MatValueError(cell.name, "has a cell that is no text", TEXTS)
    texts = cell.rows()
    if len(texts) != 1:
        raise MatValueError(cell.name, "has a cell of several texts", "save one text a cell")
    return texts[0]
