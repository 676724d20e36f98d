"""The data elements of MATLAB files of version 5 (MathWorks, MAT-File Format, chapter 1).

SciPy reads such files too, but a damaged one can take the whole interpreter down with it, and then nothing
says which file it was. What a recording needs of the format is small enough to be read here, within bounds.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.recording.csv_table import MAX_BYTES
from swesbi.recording.mat_values import DAMAGED, SAVE_AGAIN, MatValueError

HEADER_BYTES: Final = 128
BYTE_ORDERS: Final = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
INT32, MATRIX, COMPRESSED, UTF8 = 5, 14, 15, 16
NUMBERS: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
CHARACTERS: Final = {1: "latin-1", 2: "latin-1", 4: "utf-16", UTF8: "utf-8", 17: "utf-16", 18: "utf-32"}
CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
COMPLEX: Final = 0x0800

Element = tuple[int, bytes]


@dataclass(frozen=True)
class Matrix:
    """One array: its name, class and shape, and the elements that hold its values.

    Attributes:
        name: Empty within cells and structs.
        kind: Class of the array.
        imaginary: Whether it is complex.
        shape: Its dimensions; empty for objects, which are not read.
        parts: The elements after its name.
        order: Byte order, "<" or ">".
    """

    name: str
    kind: int
    imaginary: bool
    shape: tuple[int, ...]
    parts: tuple[Element, ...]
    order: str

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.shape)

    def children(self) -> list[Matrix]:
        """Return the arrays within a cell array or struct."""
        return [read_matrix(body, self.order) for kind, body in self.parts if kind == MATRIX]


def read_variables(path: Path) -> list[Matrix]:
    """Return the variables of a file.

    Raises:
        MatValueError: It is no such file, or damaged.
    """
    content = path.read_bytes()
    order = BYTE_ORDERS.get(content[HEADER_BYTES - 4 : HEADER_BYTES])
    if order is None:
        raise damaged("no header of version 5")
    matrices = (_decompressed(element, order) for element in _elements(content[HEADER_BYTES:], order))
    return [read_matrix(body, order) for kind, body in matrices if kind == MATRIX]


def read_matrix(body: bytes, order: str) -> Matrix:
    """Read one array from the body of its element; an empty body is an empty array.

    Raises:
        MatValueError: It is damaged.
    """
    if not body:
        return Matrix("", CELL, False, (0, 0), (), order)
    parts = tuple(_elements(body, order))
    if len(parts) < 3 or len(parts[0][1]) != 8:
        raise damaged("an array without its flags, dimensions and name")
    flags = int(struct.unpack(order + "II", parts[0][1])[0])
    kind = flags & 0xFF
    if kind in {OBJECT, FUNCTION, OPAQUE}:
        return Matrix(_name(parts[1] if kind == OPAQUE else parts[2]), kind, False, (), (), order)
    shape = integers(parts[1], order)
    if not shape or min(shape) < 0:
        raise damaged(f"an array of dimensions {shape}")
    return Matrix(_name(parts[2]), kind, bool(flags & COMPLEX), shape, parts[3:], order)


def integers(element: Element, order: str) -> tuple[int, ...]:
    """Return the 32-bit integers of an element, which tell dimensions and widths.

    Raises:
        MatValueError: It holds something else.
    """
    if element[0] != INT32:
        raise damaged(f"dimensions of the type {element[0]}")
    return tuple(int(number) for number in values(element, order))


def values(element: Element, order: str) -> NDArray[np.generic]:
    """Return the numbers of an element, in the type in which they are stored.

    Raises:
        MatValueError: It holds no whole number of numbers.
    """
    kind, body = element
    if kind not in NUMBERS or len(body) % np.dtype(NUMBERS[kind]).itemsize:
        raise damaged(f"numbers of the unknown type {kind}")
    return np.frombuffer(body, dtype=order + NUMBERS[kind])


def characters(element: Element, order: str) -> str:
    """Return the text of an element.

    Raises:
        MatValueError: It holds no text.
    """
    kind, body = element
    if kind not in CHARACTERS:
        raise damaged(f"characters of the unknown type {kind}")
    ending = {"<": "-le", ">": "-be"}[order] if CHARACTERS[kind].endswith(("16", "32")) else ""
    return body.decode(CHARACTERS[kind] + ending, "replace")


def damaged(what: str) -> MatValueError:
    """Return the error of a file that does not follow the format, to be raised."""
    return MatValueError(None, f"{DAMAGED} ({what})", SAVE_AGAIN)


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


def _name(element: Element) -> str:
    return element[1].rstrip(b"\0").decode("latin-1")
