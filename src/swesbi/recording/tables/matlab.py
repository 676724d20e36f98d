"""MATLAB recordings: vectors of the columns' names, or fields of one struct; versions 5 to 7.3, and h5py.

A damaged file may take the interpreter down with SciPy, or swell beyond memory. So a file is read in a
process of its own, ``python -I matlab.py FILE``, which prints every variable, or why it cannot be used.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:  # the child imports nothing of this project
    from swesbi.recording.problems import RecordingError
    from swesbi.recording.tables.table import Table

MOST_VALUES: Final = 5_000_000
MOST_CELLS: Final = 200_000
"""Cells of version 7.3, each of which is a dataset of its own."""
MOST_BYTES: Final = 4 * 1024**3
LONGEST_S: Final = 60.0
HDF5: Final = b"\x89HDF\r\n\x1a\n"
USER_BLOCK: Final = 512
OCTAVE_TEXT: Final = (b"# Created by Octave", b"# name:")
VECTOR: Final = "save one value per attempted sample, as a vector"
NUMBERS: Final = "save it as a real vector of numbers"
NO_TABLE: Final = "convert a table by s = table2struct(T, 'ToScalar', true) and strings by cellstr(...)"
SAVE_AGAIN: Final = "save it again, by save('ID.mat', '-struct', 's'), or give a CSV file"
LAYOUT: Final = "save vectors of these names, or one struct with these fields: save('ID.mat', '-struct', 's')"
REFUSED: Final = {
    "cell": ("has a cell that is no text", "save texts as a cell array, numbers as a vector"),
    "texts": ("has a cell of several texts", "save one text a cell"),
    "struct": ("is a struct", NUMBERS),
    "sparse": ("is a sparse matrix", NUMBERS),
    "complex": ("is complex", NUMBERS),
    "object": ("is a MATLAB object, not plain values", NO_TABLE),
    "link": ("is a link, not a variable", SAVE_AGAIN),
    "elsewhere": ("keeps its values in another file", SAVE_AGAIN),
    "large": ("has more values than a recording", "keep one value a sample, no images or raw data"),
}
Printed = Mapping[str, Any]
"""A variable as it is printed: ``values``, or the ``fields`` of a struct, or what is ``wrong`` with it."""


# --- the child


def printed(value: Any) -> Printed:  # noqa: ANN401
    """Return a variable as it is printed: values column by column; a key of ``REFUSED`` as what is wrong."""
    if isinstance(value, dict):
        return {"fields": {name: printed(item) for name, item in value.items()}}
    if isinstance(value, str):
        return {"wrong": REFUSED[value]}
    if value.dtype.kind not in "UO" and 0 not in value.shape and sum(size != 1 for size in value.shape) > 1:
        return {"wrong": (f"is an array of {' x '.join(map(str, value.shape))}", VECTOR)}
    if value.dtype.kind == "U":
        return {"values": [text.rstrip() for text in value.ravel().tolist()]}
    if value.dtype.kind != "O":
        return {"values": value.ravel(order="F").astype(np.float64).tolist()}
    if any(isinstance(cell, dict | str) for cell in value.ravel()):
        return {"wrong": REFUSED["cell"]}
    cells = [np.asarray(cell) for cell in value.ravel(order="F")]
    if cells and all(cell.dtype.kind in "biuf" and cell.size <= 1 for cell in cells):
        return {"values": [float(cell.ravel()[0]) if cell.size else np.nan for cell in cells]}
    if wrong := [cell for cell in cells if cell.size and (cell.dtype.kind != "U" or cell.size > 1)]:
        return {"wrong": REFUSED["texts" if wrong[0].dtype.kind == "U" else "cell"]}
    return {"values": ["".join(cell.ravel().tolist()).rstrip() for cell in cells]}


def before_73(path: str) -> dict[str, Any]:
    """Return the variables of a file of versions 5 to 7; a struct as the dictionary of its fields."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabFunction, MatlabOpaque
    from scipy.sparse import issparse

    def plain(value: Any) -> Any:  # noqa: ANN401
        if issparse(value) or isinstance(value, MatlabOpaque | MatlabFunction):
            return "sparse" if issparse(value) else "object"
        if value.size > MOST_VALUES or value.dtype.kind == "c":
            return "large" if value.size > MOST_VALUES else "complex"
        if value.dtype.names is None:
            return value
        return {
            name: plain(value[name].item()) if value.size == 1 else value[name] for name in value.dtype.names
        }

    found = loadmat(path, squeeze_me=False, chars_as_strings=True)
    known = {name: plain(value) for name, value in found.items() if name[:2] != "__"}
    # what MATLAB keeps of its own classes stands under a name of no letters
    own = [
        name for name in found if name[:2] == "__" and name[:8] not in ("__header", "__versio", "__global")
    ]
    return known | ({"#subsystem#": "object"} if own else {})


def of_hdf5(path: str) -> dict[str, Any]:
    """Return the same of a file of HDF5, of version 7.3 or by h5py; no link and no other file is followed."""
    import h5py

    def plain(item: Any) -> Any:  # noqa: ANN401
        if isinstance(item, h5py.Group):
            return members(item)
        is_cell = h5py.check_ref_dtype(item.dtype) is not None
        kind = item.attrs.get("MATLAB_class", b"cell" if is_cell else b"double")
        kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
        size = item.size or 0
        if size > MOST_VALUES or item.nbytes > MOST_BYTES or (is_cell and size > MOST_CELLS):
            return "large"
        if item.external or item.is_virtual:
            return "elsewhere"
        if item.attrs.get("MATLAB_empty", 0):
            return np.empty((0, 0), dtype="U1" if kind == "char" else "f8")
        if h5py.check_string_dtype(item.dtype):
            return np.asarray(item.asstr()[()], dtype=np.str_)
        values = np.asarray(item[()]).T
        if is_cell:
            cells = np.empty(values.size, dtype=object)
            cells[:] = [plain(item.file[reference]) for reference in values.ravel(order="F")]
            return cells
        if kind == "char":
            rows = np.atleast_2d(values).astype("<u2")
            return np.array([row.tobytes().decode("utf-16-le", "replace").rstrip() for row in rows])
        return values if values.dtype.kind in "biuf" else ("complex" if values.dtype.names else "object")

    def members(group: Any) -> dict[str, Any]:  # noqa: ANN401
        found: dict[str, Any] = {}
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                found[name] = "link"
            elif name == "#subsystem#":
                found[name] = "object"
            elif not name.startswith("#"):
                found[name] = plain(group[name])
        return found

    with h5py.File(path) as file:
        return members(file)


def main(path: str) -> None:
    """Print the variables of a file."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    with Path(path).open("rb") as file:
        start = file.read(USER_BLOCK + len(HDF5))
    read = of_hdf5 if HDF5 in (start[: len(HDF5)], start[USER_BLOCK:]) else before_73
    json.dump({name: printed(value) for name, value in read(path).items()}, sys.stdout)


# --- who asks it


def read_matlab(path: Path, names: Sequence[str]) -> Table:
    """Return the vectors of a file as columns; numbers as the shortest text that gives them back exactly.

    Among several structs, the one that has any of ``names`` as fields holds the recording.
    """
    from swesbi.recording.problems import Problem
    from swesbi.recording.tables.csv_text import read_bytes
    from swesbi.recording.tables.table import Table, column_of, shortest

    if read_bytes(path).startswith(OCTAVE_TEXT):
        raise _refused(
            path, "is text, as Octave saves it", "save it by save('-v7', 'ID.mat', ...), or give a CSV file"
        )
    members = _members(path, _asked(path), names)
    held = {name: member for name, member in members.items() if name in names} or members
    lengths = {name: len(member["values"]) for name, member in held.items() if "values" in member}
    if held is not members and len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise _refused(
            path, f"its vectors differ in length ({listed})", "give every attempted sample an element in each"
        )
    if lengths and not any(lengths.values()):
        raise _refused(path, "its vectors are empty", "save at least one sample")
    size = max(lengths.values(), default=0)
    wrong = {
        name: member.get("wrong", REFUSED["struct"])
        for name, member in members.items()
        if "values" not in member
    }
    closed = {
        name: Problem(str(path), reason, remedy, column=name) for name, (reason, remedy) in wrong.items()
    }
    values = {name: member.get("values", [""] * size) for name, member in members.items()}
    cells = {
        name: column_of(each.strip() if isinstance(each, str) else shortest(each) for each in own)
        for name, own in values.items()
        if len(own) == size
    }
    return Table(str(path), cells, np.arange(1, size + 1), unit="element", closed=closed, remedy=LAYOUT)


def _members(path: Path, variables: Mapping[str, Printed], names: Sequence[str]) -> Mapping[str, Printed]:
    """Return the variables, or in their place the fields of the one struct that holds the recording."""
    structs = {name: item["fields"] for name, item in variables.items() if "fields" in item}
    holding = [name for name, fields in structs.items() if set(fields) & set(names)]
    if set(variables) & set(names):
        return variables
    if len(holding) > 1:
        raise _refused(path, f"holds several recordings ({', '.join(holding)})", "save one struct a file")
    if holding:
        return dict(structs[holding[0]])
    if any(tuple(item.get("wrong", ())) == REFUSED["object"] for item in variables.values()):
        raise _refused(path, "holds a table or another MATLAB object", NO_TABLE)
    return variables


def _asked(path: Path) -> dict[str, Printed]:
    """Return what the child prints of a file."""
    command = [sys.executable, "-I", __file__, str(path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=LONGEST_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise _refused(
            path, f"cannot be read as a .mat file (it takes more than {LONGEST_S:.0f} s)", SAVE_AGAIN
        ) from error
    if done.returncode == 0:
        return dict(json.loads(done.stdout))
    said = done.stderr.decode("utf-8", "replace").strip().splitlines()
    why = said[-1] if said and done.returncode > 0 else "SciPy dies of it"
    raise _refused(path, f"cannot be read as a .mat file ({why})", SAVE_AGAIN)


def _refused(path: Path, reason: str, remedy: str) -> RecordingError:
    from swesbi.recording.problems import refusal

    return refusal(path, reason, remedy)


if __name__ == "__main__":
    main(*sys.argv[1:])
