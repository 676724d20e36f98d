"""Reading and writing artefacts: netCDF-compatible HDF5 through xarray, and JSON."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr

from swesbi.artefacts.provenance import SCHEMA_VERSION, Provenance, read_provenance
from swesbi.artefacts.schema import check_groups

ROOT = "/"


class ArtefactError(ValueError):
    """A file that is not the artefact it should be; the message says which, why and what to do."""


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` that becomes ``path`` when the block ends without error.

    A reader, or a run that was interrupted, therefore sees the old file, the new one or none.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def save(path: Path, groups: xr.Dataset | Mapping[str, xr.Dataset], provenance: Provenance) -> None:
    """Write datasets to the HDF5 file ``path``, atomically.

    Args:
        path: File to write; its folder is made if need be.
        groups: One dataset, or one a group; the group "/" is the root.
        provenance: Becomes the root attributes.

    Raises:
        ArtefactError: A dataset of the schema is missing, or has other dimensions or units.
    """
    named = {ROOT: groups} if isinstance(groups, xr.Dataset) else dict(groups)
    try:
        check_groups(provenance.kind, named)
    except ValueError as error:
        raise ArtefactError(f"{path}: {error}") from error
    root = named.pop(ROOT, xr.Dataset()).assign_attrs(provenance.attributes())
    with atomic_path(path) as temporary:
        _labelled(root).to_netcdf(temporary, mode="w", engine="h5netcdf")
        for name, dataset in named.items():
            _labelled(dataset).to_netcdf(temporary, mode="a", engine="h5netcdf", group=name)


def load(path: Path, kind: str, group: str = ROOT) -> tuple[xr.Dataset, Provenance]:
    """Read one group of an artefact into memory, with its provenance.

    Raises:
        ArtefactError: The file cannot be read, or is of another kind or schema version.
    """
    try:
        with xr.open_dataset(path, engine="h5netcdf") as root:
            provenance = read_provenance(root.attrs)
        with xr.open_dataset(path, engine="h5netcdf", group=group) as dataset:
            dataset.load()
    except (OSError, KeyError, ValueError) as error:
        raise ArtefactError(
            f"{path}: cannot be read as a swesbi artefact ({error}); delete it and rerun"
        ) from error
    _check_identity(path, kind, provenance)
    return dataset, provenance


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file atomically, indented, in the order given."""
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _labelled(dataset: xr.Dataset) -> xr.Dataset:
    """Give labels and indices the units of what has none."""
    bare = {name: label for name, label in dataset.coords.items() if "units" not in label.attrs}
    return dataset.assign_coords({name: label.assign_attrs(units="1") for name, label in bare.items()})


def _check_identity(path: Path, kind: str, provenance: Provenance) -> None:
    if provenance.kind != kind:
        raise ArtefactError(f"{path}: holds a {provenance.kind!r} artefact, expected {kind!r}")
    if provenance.schema_version != SCHEMA_VERSION:
        raise ArtefactError(
            f"{path}: has schema version {provenance.schema_version}, this swesbi reads {SCHEMA_VERSION}; "
            "delete it and rerun"
        )
