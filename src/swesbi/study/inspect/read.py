"""What a file of the study holds, whatever its format: facts, settings, arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, DamagedArtefactError, Provenance, files, read_provenance
from swesbi.artefacts.atomic import typed
from swesbi.artefacts.provenance import SCHEMA_VERSION

ORIGIN: Final = "made by"
SETTINGS: Final = "settings"
FACTS: Final = "says"
OF_PROVENANCE: Final = tuple(Provenance("").attributes())
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


@dataclass(frozen=True)
class Array:
    """One array: ``values`` of numbers or text, along named dimensions."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    units: str = ""
    meaning: str = ""

    @property
    def is_numeric(self) -> bool:
        """Whether the values are numbers."""
        return self.values.dtype.kind in "biuf"


@dataclass(frozen=True)
class Content:
    """One file.

    Attributes:
        path: The file.
        kind: What it is: the kind of an artefact, and of another file its format.
        sections: What it says, text by key: ``ORIGIN`` (version, code hash, seed, subject), the ``SETTINGS``
            behind it, their nested keys joined by dots, and other ``FACTS``.
        arrays: Its arrays.
    """

    path: Path
    kind: str
    sections: Mapping[str, Mapping[str, str]]
    arrays: tuple[Array, ...] = ()


def flatten(plain: object, key: str = "") -> dict[str, str]:
    """Return nested plain data as text by key: ``{"prior": {"low": 2}}`` becomes ``{"prior.low": "2"}``."""
    return dict(_leaves(plain, key))


def _leaves(plain: object, key: str) -> Iterator[tuple[str, str]]:
    if isinstance(plain, dict):
        for name, value in plain.items():
            yield from _leaves(value, f"{key}.{name}" if key else str(name))
    elif isinstance(plain, list) and any(isinstance(item, dict | list) for item in plain):
        for index, value in enumerate(plain):
            yield from _leaves(value, f"{key}[{index}]")
    elif isinstance(plain, list | tuple):
        yield key, ", ".join(map(str, plain))
    else:
        yield key, str(plain)


def read(path: Path) -> Content:
    """Return what a file holds, once its checksum, if it has one, is known to be right.

    Raises:
        ArtefactError: There is no such file, it cannot be read or it is damaged, or of a format that is
            not described.
    """
    if path.is_dir():
        check = typed("swesbi", "inspect", "--check", path)
        remedy = f"name files in it, or check all its artefacts by: {check}"
        raise ArtefactError(f"{path}: is a folder; {remedy}")
    if not path.is_file():
        raise ArtefactError(f"{path}: no such file")
    if path.suffix not in READERS:
        known = ", ".join(READERS)
        raise ArtefactError(f"{path}: {path.suffix or 'no suffix'} is not among the formats shown: {known}")
    return READERS[path.suffix](path)


def _read_hdf5(path: Path) -> Content:
    _check_whole(path, files.hdf5_provenance)
    try:
        files.check_self_contained(path)
        provenance = files.hdf5_provenance(path)
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            arrays = tuple(
                _array(f"{node.path}/{name}".strip("/"), variable)
                for node in tree.subtree
                for name, variable in node.to_dataset(inherit=False).variables.items()
            )
    except files.UNREADABLE as error:
        raise DamagedArtefactError(path, f"cannot be read as a swesbi artefact ({error})") from error
    return _artefact(path, provenance, arrays, {})


def _array(name: str, variable: xr.Variable) -> Array:
    values, attributes = variable.to_numpy(), variable.attrs
    return Array(
        name=name,
        dims=tuple(map(str, variable.dims)),
        values=values if values.dtype.kind in "biuf" else values.astype(str),
        units=str(attributes.get("units", "")),
        meaning=str(attributes.get("long_name", "")),
    )


def _read_weights(path: Path) -> Content:
    """Return a file of weights: its metadata, and every tensor by the names that lead to it."""
    # torch takes seconds to import, and most files need none of it
    from swesbi.networks.files import NOT_PLAIN, plain_provenance, read_content

    _check_whole(path, plain_provenance)
    try:
        content = read_content(path)
        metadata = content["metadata"]
        provenance = read_provenance(metadata)
    except NOT_PLAIN as error:
        raise DamagedArtefactError(path, f"cannot be read as a file of weights ({error})") from error
    arrays = tuple(array for name in content if name != "metadata" for array in _tensors(name, content[name]))
    facts = {name: _plain(value) for name, value in metadata.items() if name not in OF_PROVENANCE}
    return _artefact(path, provenance, arrays, flatten(facts))


def _tensors(name: str, value: Any) -> Iterator[Array]:  # noqa: ANN401
    """Yield the tensors of nested dictionaries."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _tensors(f"{name}/{key}", item)
    else:
        yield Array(name, tuple(f"d{axis}" for axis in range(value.ndim)), value.numpy(), "1")


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return metadata as nested data where it is written as JSON."""
    return json.loads(value) if isinstance(value, str) and value.startswith("{") else value


def _check_whole(path: Path, provenance: Callable[[Path], Provenance]) -> None:
    """Refuse an artefact that was cut off or changed; one from before checksums has none."""
    if not files.has_checksum(path):
        try:
            version = provenance(path).schema_version
        except files.UNREADABLE:
            version = SCHEMA_VERSION
        if version < SCHEMA_VERSION:
            return
    files.check_whole(path, provenance)


def _artefact(
    path: Path, provenance: Provenance, arrays: tuple[Array, ...], facts: Mapping[str, str]
) -> Content:
    """Return an artefact with its provenance in words."""
    origin = {
        "subject": provenance.subject or "whole cohort",
        "seed": str(provenance.seed),
        "swesbi": provenance.package_version,
        "code hash": provenance.code_hash or "not recorded",
        "schema version": str(provenance.schema_version),
    }
    sections = {ORIGIN: origin, SETTINGS: flatten(dict(provenance.settings)), FACTS: facts}
    return Content(path, provenance.kind, sections, arrays)


def _read_csv(path: Path) -> Content:
    table = _parsed(path, "a table", pd.read_csv)
    arrays = tuple(_column(str(name), column) for name, column in table.items())
    return _file(path, {"rows": str(len(table)), "columns": str(len(arrays))}, arrays)


def _column(name: str, column: pd.Series) -> Array:
    units = next((units for ending, units in UNITS.items() if name.endswith(ending)), "")
    is_number = pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column)
    values = column.to_numpy() if is_number else np.asarray(column.fillna("")).astype(str)
    return Array(name, ("row",), values, units)


def _read_json(path: Path) -> Content:
    return _file(path, flatten(_parsed(path, "JSON", lambda each: json.loads(each.read_text("utf-8")))))


def _read_yaml(path: Path) -> Content:
    return _file(path, flatten(_parsed(path, "YAML", lambda each: yaml.safe_load(each.read_text("utf-8")))))


def _parsed(path: Path, form: str, parse: Callable[[Path], Any]) -> Any:  # noqa: ANN401
    try:
        return parse(path)
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise ArtefactError(f"{path}: cannot be read as {form} ({error})") from error


def _file(path: Path, facts: Mapping[str, str], arrays: tuple[Array, ...] = ()) -> Content:
    """Return a file that is no artefact, and so says nothing of its origin."""
    return Content(path, f"{path.suffix[1:]} file", {FACTS: facts}, arrays)


READERS: Final[Mapping[str, Callable[[Path], Content]]] = {
    ".h5": _read_hdf5,
    ".pt": _read_weights,
    ".csv": _read_csv,
    ".json": _read_json,
    ".yaml": _read_yaml,
}
