"""Reading MATLAB recordings: the columns of the CSV format as vectors, or as fields of one struct."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts.files import open_hdf5
from swesbi.base.arrays import FloatArray, TextArray
from swesbi.recording.content import read_bytes
from swesbi.recording.mat_child import read_mat_v5
from swesbi.recording.mat_values import SAVE_AGAIN, TEXTS, MatValueError, Vector, damaged, read_vectors
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.table import TextTable, check_names, shortest

MAX_VALUES: Final = 5_000_000
OBJECTS: Final = "#subsystem#"
NUMERIC: Final = frozenset(
    {"double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}
)
HDF5_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
V73_USER_BLOCK: Final = 512
LAYOUT: Final = "save vectors of these names, or one struct with these fields: save('ID.mat', '-struct', 's')"


@dataclass(frozen=True)
class Item:
    """One dataset or group, as ``mat_child.Loaded``; its values are read when asked for."""

    name: str
    item: h5py.Dataset | h5py.Group

    @property
    def kind(self) -> str:
        """What it is, as of ``mat_child.Loaded``: MATLAB notes the class, and whether it is empty."""
        if not isinstance(self.item, h5py.Dataset):
            return "object" if self.name == OBJECTS else "struct"
        if h5py.check_ref_dtype(self.item.dtype) and "MATLAB_class" not in self.item.attrs:
            return "cell"  # a field of an array of structs
        noted = self.item.attrs.get("MATLAB_class", b"double")
        kind = noted.decode("ascii", "replace") if isinstance(noted, bytes) else str(noted)
        if self._is_empty or (kind in NUMERIC and self.item.dtype.kind in "biuf"):
            return "number"
        return "complex" if kind in NUMERIC else kind

    @property
    def shape(self) -> tuple[int, ...]:
        """Its dimensions; an empty one holds them as its values."""
        return (0,) if self._is_empty else tuple(getattr(self.item, "shape", None) or ())

    def numbers(self) -> FloatArray:
        """Return its numbers, one after the other."""
        values = self._values()
        return np.empty(0) if self._is_empty else values.ravel().astype(np.float64)

    def rows(self) -> list[str]:
        """Return the rows of a char matrix, stored as UTF-16 codes, column by column."""
        codes = self._values()
        if codes.ndim != 2 or codes.dtype.kind != "u":
            raise MatValueError(self.name, "holds no readable text", TEXTS)
        rows = codes.T.astype("<u2")
        return [row.tobytes().decode("utf-16-le", "replace").rstrip() for row in rows]

    def cells(self) -> list[Item]:
        """Return what the cells of a cell array refer to."""
        references = self._values().ravel()
        if not all(isinstance(reference, h5py.Reference) for reference in references):
            raise MatValueError(self.name, "has a cell that refers to nothing", SAVE_AGAIN)
        return [Item(self.name, self.item.file[reference]) for reference in references]

    def fields(self) -> Mapping[str, Item]:
        """Return the members of a group."""
        return _members(self.item) if isinstance(self.item, h5py.Group) else {}

    @cached_property
    def _is_empty(self) -> bool:
        return bool(self.item.attrs.get("MATLAB_empty", 0))

    def _values(self) -> NDArray[Any]:
        """Read a dataset that lies in the file itself and is not too large."""
        if self.item.external or self.item.is_virtual:
            raise MatValueError(self.name, "keeps its values in another file", SAVE_AGAIN)
        if self.item.size is None or self.item.size > MAX_VALUES:
            reason = f"has {self.item.size} values, the limit is {MAX_VALUES}"
            remedy = "keep one value per attempted sample, no images or raw data"
            raise MatValueError(self.name, reason, remedy)
        return np.asarray(self.item[()])


def read_mat_v73(path: Path, names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that the file holds, from its variables or from one struct.

    Raises:
        MatValueError: The file is damaged, or a variable is neither numbers nor texts, or lies elsewhere.
    """
    try:
        with open_hdf5(path) as file:
            return read_vectors(_members(file), names)
    except MatValueError:
        raise
    # h5py passes on whatever its library says of a damaged file, under many types
    except Exception as error:
        raise damaged(f"{type(error).__name__}: {error}") from error


def _members(group: h5py.Group) -> dict[str, Item]:
    """Return what lies in a group itself; a link to elsewhere, another file even, is refused."""
    items = {}
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise MatValueError(name, "is a link, not a variable", SAVE_AGAIN)
        if name == OBJECTS or not name.startswith("#"):
            items[name] = Item(name, group[name])
    return items


def read_mat_table(path: Path, required: Sequence[str], optional: Sequence[str] = ()) -> TextTable:
    """Read the columns of a .mat file (version 5 to 7, or 7.3) as text; other variables are ignored.

    Numbers become the shortest text that gives them back exactly, so a recording passes the same checks, and
    yields the same values, as its twin in CSV.

    Raises:
        RecordingError: The file is missing or no .mat file, or its vectors are missing or do not fit.
    """
    content = read_bytes(path)
    names = (*required, *optional)
    hdf5 = content.startswith(HDF5_SIGNATURE, V73_USER_BLOCK) or content.startswith(HDF5_SIGNATURE)
    try:
        vectors = read_mat_v73(path, names) if hdf5 else read_mat_v5(path, names)
    except MatValueError as error:
        raise RecordingError(Problem(str(path), error.reason, error.remedy, column=error.name)) from error
    raise_any(check_names(str(path), list(vectors), required, LAYOUT))
    _check_lengths(path, vectors)
    cells = {name: _as_text(vectors[name]) for name in names if name in vectors}
    size = len(next(iter(vectors.values()), ()))
    return TextTable(str(path), cells, np.arange(1, size + 1), unit="element")


def _check_lengths(path: Path, vectors: Mapping[str, Vector]) -> None:
    lengths = {name: len(vector) for name, vector in vectors.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        reason = f"its vectors differ in length ({listed})"
        raise RecordingError(Problem(str(path), reason, "give every attempted sample an element in each"))
    if not all(lengths.values()):
        raise RecordingError(Problem(str(path), "its vectors are empty", "save at least one sample"))


def _as_text(vector: Vector) -> TextArray:
    if vector.dtype.kind == "U":
        return np.array([str(text).strip() for text in vector], dtype=object)
    values, positions = np.unique(vector.astype(np.float64), return_inverse=True)
    return np.array([shortest(value) for value in values.tolist()], dtype=object)[positions]
