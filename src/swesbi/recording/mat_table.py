"""Reading MATLAB recordings: the columns of the CSV format as vectors, or as the fields of one struct."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.recording.csv_table import read_bytes
from swesbi.recording.mat_v5 import read_mat_v5
from swesbi.recording.mat_v73 import read_mat_v73
from swesbi.recording.mat_values import MatValueError, Vector
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.table import Table, check_names

HDF5_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
V73_USER_BLOCK: Final = 512
LAYOUT: Final = "save vectors of these names, or one struct with these fields: save('ID.mat', '-struct', 's')"


def read_mat_table(path: Path, required: Sequence[str], optional: Sequence[str] = ()) -> Table:
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
    cells = pd.DataFrame({name: _as_text(vectors[name]) for name in names if name in vectors}, dtype=object)
    return Table(str(path), cells, np.arange(1, len(cells) + 1), unit="element")


def _check_lengths(path: Path, vectors: Mapping[str, Vector]) -> None:
    lengths = {name: len(vector) for name, vector in vectors.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        reason = f"its vectors differ in length ({listed})"
        raise RecordingError(Problem(str(path), reason, "give every attempted sample an element in each"))
    if not all(lengths.values()):
        raise RecordingError(Problem(str(path), "its vectors are empty", "save at least one sample"))


def _as_text(vector: Vector) -> NDArray[np.object_]:
    if vector.dtype.kind == "U":
        return np.array([str(text).strip() for text in vector], dtype=object)
    values, positions = np.unique(vector.astype(np.float64), return_inverse=True)
    return np.array([_shortest(value) for value in values.tolist()], dtype=object)[positions]


def _shortest(value: float) -> str:
    """Return 7 for 7.0, and otherwise the shortest text that Python reads back as the same number."""
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else repr(value).replace("nan", "NaN")
