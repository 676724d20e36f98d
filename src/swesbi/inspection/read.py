"""Reading a file of the study by its format."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import pandas as pd
import yaml

from swesbi.artefacts import ArtefactError
from swesbi.inspection.content import Array, Content, as_text, flatten
from swesbi.inspection.hdf5 import read_hdf5
from swesbi.inspection.weights import read_weights
from swesbi.inspection.words import file_in_words

UNITS: Final = {
    "_kpa": "kPa",
    "_per_s": "s-1",
    "_percent": "%",
    "_m_s": "m s-1",
    "_ml": "mL",
    "_ms": "ms",
    "_cm": "cm",
    "_m2": "m2",
    "_bpm": "min-1",
    "_years": "year",
}
"""Units by how the name of a column ends."""


def read(path: Path) -> Content:
    """Return what a file holds, once its checksum, if it has one, is known to be right.

    Raises:
        ArtefactError: There is no such file, it cannot be read or it is damaged, or of a format that is
            not described.
    """
    if not path.is_file():
        raise ArtefactError(f"{path}: no such file")
    if path.suffix not in READERS:
        known = ", ".join(READERS)
        raise ArtefactError(f"{path}: {path.suffix or 'no suffix'} is not among the formats shown: {known}")
    return READERS[path.suffix](path)


def _read_csv(path: Path) -> Content:
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise ArtefactError(f"{path}: cannot be read as a table ({error})") from error
    arrays = tuple(_column(str(name), column) for name, column in table.items())
    return _described(path, {"rows": str(len(table)), "columns": str(len(arrays))}, arrays)


def _column(name: str, column: pd.Series) -> Array:
    units = next((units for ending, units in UNITS.items() if name.endswith(ending)), "")
    is_number = pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column)
    return Array(name, ("row",), column.to_numpy() if is_number else as_text(column.fillna("")), units)


def _read_json(path: Path) -> Content:
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ArtefactError(f"{path}: cannot be read as JSON ({error})") from error
    return _described(path, flatten(plain), ())


def _read_yaml(path: Path) -> Content:
    try:
        plain = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise ArtefactError(f"{path}: cannot be read as YAML ({error})") from error
    return _described(path, flatten(plain), ())


def _described(path: Path, facts: Mapping[str, str], arrays: tuple[Array, ...]) -> Content:
    return Content(path, file_in_words(path), "", {}, {}, facts, arrays)


READERS: Final[Mapping[str, Callable[[Path], Content]]] = {
    ".h5": read_hdf5,
    ".pt": read_weights,
    ".csv": _read_csv,
    ".json": _read_json,
    ".yaml": _read_yaml,
}
