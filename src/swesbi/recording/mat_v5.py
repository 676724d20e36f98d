"""MATLAB files of versions 5 to 7 (MathWorks, MAT-File Format, chapter 1).

SciPy reads such files too, but it reads some damaged ones, and others take the interpreter down with them: a
process of its own would have to bear that, at a second a file. What a recording needs of the format is small
enough to be read here, within bounds.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.arrays import FloatArray
from swesbi.recording.mat_values import Vector, damaged, read_vectors
from swesbi.recording.table import MAX_BYTES

HEADER_BYTES: Final = 128
BYTE_ORDERS: Final = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
INT32, MATRIX, COMPRESSED = 5, 14, 15
NUMBERS: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
CHARACTERS: Final = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
OPAQUE: Final = 17
KINDS: Final = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 16: "object", OPAQUE: "object"}
COMPLEX: Final = 0x0800
Element = tuple[int, bytes]


@dataclass(frozen=True)
class Matrix:
    """One array, a ``MatVariable``: what it is, and the elements that hold its values.

    Attributes:
        name: Its name, or that of the array that it is a cell of.
        kind: What it is, as of any ``MatVariable``.
        shape: Its dimensions; empty for objects, which are not read.
        parts: The elements after its name.
        order: Byte order, "<" or ">".
    """

    name: str
    kind: str
    shape: tuple[int, ...]
    parts: tuple[Element, ...]
    order: str

    def numbers(self) -> FloatArray:
        """Return its numbers, one after the other."""
        numbers = _values(self.parts[0], self.order) if self.parts else np.empty(0)
        if numbers.size != math.prod(self.shape):
            raise damaged(f"{self.name} with {numbers.size} of {math.prod(self.shape)} values")
        return numbers.astype(np.float64)

    def rows(self) -> list[str]:
        """Return the rows of a char matrix, which is stored column by column."""
        text = _characters(self.parts[0], self.order) if self.parts else ""
        if len(self.shape) != 2 or len(text) != math.prod(self.shape):
            raise damaged(f"{self.name} with {len(text)} of {math.prod(self.shape)} characters")
        return [text[start :: self.shape[0]].rstrip() for start in range(self.shape[0])]

    def cells(self) -> list[Matrix]:
        """Return the arrays within a cell array."""
        return [_matrix(body, self.order, self.name) for kind, body in self.parts if kind == MATRIX]

    def fields(self) -> dict[str, Matrix]:
        """Return the fields of a struct: first comes the width of a name, then all names, then the values."""
        if math.prod(self.shape) != 1:
            return {}
        width = _integers(self.parts[0], self.order) if len(self.parts) > 1 else ()
        if len(width) != 1 or width[0] < 1:
            raise damaged(f"the struct {self.name} with names of no width")
        text, bodies = self.parts[1][1], [body for kind, body in self.parts if kind == MATRIX]
        names = [_name(text[start : start + width[0]]) for start in range(0, len(text), width[0])]
        if len(bodies) != len(names):
            raise damaged(f"the struct {self.name} with {len(names)} names and {len(bodies)} values")
        return {name: _matrix(body, self.order, name) for name, body in zip(names, bodies, strict=True)}


def read_mat_v5(path: Path, names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that the file holds, from its variables or from one struct.

    Raises:
        MatValueError: It is no such file, or damaged, or a variable is neither numbers nor texts.
    """
    content = path.read_bytes()
    order = BYTE_ORDERS.get(content[HEADER_BYTES - 4 : HEADER_BYTES])
    if order is None:
        raise damaged("no header of version 5")
    elements = (_decompressed(element, order) for element in _elements(content[HEADER_BYTES:], order))
    matrices = [_matrix(body, order) for kind, body in elements if kind == MATRIX]
    return read_vectors({matrix.name: matrix for matrix in matrices}, names)


def _matrix(body: bytes, order: str, name: str = "") -> Matrix:
    """Read one array from the body of its element; an empty body is an empty array.

    Args:
        body: Flags, dimensions, name and values.
        order: Byte order.
        name: Name where the array has none of its own: within cells and structs.
    """
    if not body:
        return Matrix(name, "cell", (0, 0), (), order)
    parts = tuple(_elements(body, order))
    if len(parts) < 3 or len(parts[0][1]) != 8:
        raise damaged("an array without its flags, dimensions and name")
    flags = int(struct.unpack(order + "II", parts[0][1])[0])
    kind = KINDS.get(flags & 0xFF, "complex" if flags & COMPLEX else "number")
    name = _name(parts[1 if flags & 0xFF == OPAQUE else 2][1]) or name
    if kind == "object":
        return Matrix(name, kind, (), (), order)
    shape = _integers(parts[1], order)
    if not shape or min(shape) < 0:
        raise damaged(f"an array of dimensions {shape}")
    return Matrix(name, kind, shape, parts[3:], order)


def _elements(data: bytes, order: str) -> Iterator[Element]:
    """Yield the elements one after the other: a tag of type and size, then the body, padded to 8 bytes."""
    position = 0
    while position < len(data):
        if position + 8 > len(data):
            raise damaged("it ends within a tag")
        kind, size = struct.unpack_from(order + "II", data, position)
        small = kind >> 16  # up to four bytes stand in the tag itself, which then holds both in one word
        start = position + (4 if small else 8)
        kind, size = (kind & 0xFFFF, small) if small else (kind, size)
        if start + size > len(data) or small > 4:
            raise damaged("it ends within a value")
        yield kind, data[start : start + size]
        padding = 0 if kind == COMPRESSED else -size % 8
        position = position + 8 if small else start + size + padding


def _decompressed(element: Element, order: str) -> Element:
    kind, body = element
    if kind != COMPRESSED:
        return element
    stream = zlib.decompressobj()
    try:
        content = stream.decompress(body, MAX_BYTES)
    except zlib.error as error:
        raise damaged(str(error)) from error
    if not stream.eof:
        raise damaged("a compressed value is cut off, or larger than a recording can be")
    return next(_elements(content, order), (0, b""))


def _values(element: Element, order: str) -> NDArray[np.generic]:
    """Return the numbers of an element, in the type in which they are stored."""
    kind, body = element
    if kind not in NUMBERS or len(body) % np.dtype(NUMBERS[kind]).itemsize:
        raise damaged(f"numbers of the unknown type {kind}")
    return np.frombuffer(body, dtype=order + NUMBERS[kind])


def _integers(element: Element, order: str) -> tuple[int, ...]:
    """Return the 32-bit integers of an element, which tell dimensions and widths."""
    if element[0] != INT32:
        raise damaged(f"dimensions of the type {element[0]}")
    return tuple(int(number) for number in _values(element, order))


def _characters(element: Element, order: str) -> str:
    kind, body = element
    if kind not in CHARACTERS:
        raise damaged(f"characters of the unknown type {kind}")
    ending = {"<": "-le", ">": "-be"}[order] if CHARACTERS[kind].endswith(("16", "32")) else ""
    return body.decode(CHARACTERS[kind] + ending, "replace")


def _name(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("latin-1")
