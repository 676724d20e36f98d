"""Reading and writing artefacts: netCDF-compatible HDF5 through xarray, and JSON."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swesbi.artefacts.atomic import atomic_path
from swesbi.artefacts.checksum import append_checksum, check_bytes, has_checksum
from swesbi.artefacts.errors import ArtefactError, DamagedArtefactError, repair_command
from swesbi.artefacts.provenance import OLDEST_READ, SCHEMA_VERSION, Provenance, read_provenance
from swesbi.artefacts.schema import check_group, check_groups
from swesbi.artefacts.self_contained import check_self_contained

if TYPE_CHECKING:
    import xarray as xr

ROOT = "/"
UNREADABLE = (OSError, KeyError, TypeError, ValueError, RuntimeError)


def save(path: Path, groups: xr.Dataset | Mapping[str, xr.Dataset], provenance: Provenance) -> None:
    """Write datasets to the HDF5 file ``path``, atomically, with a checksum at its end.

    Args:
        path: File to write; its folder is made if need be.
        groups: One dataset, or one a group; the group "/" is the root.
        provenance: Becomes the root attributes.

    Raises:
        ArtefactError: A dataset of the schema is missing or differs from it, or the file cannot be written.
    """
    import xarray as xr

    named = {ROOT: groups} if isinstance(groups, xr.Dataset) else dict(groups)
    try:
        check_groups(provenance.kind, named)
    except ValueError as error:
        raise ArtefactError(f"{path}: {error}") from error
    root = named.pop(ROOT, xr.Dataset()).assign_attrs(provenance.attributes())
    # Composed in memory: the HDF5 library crashes the process when a disk fills up under it.
    buffer = io.BytesIO()
    _labelled(root).to_netcdf(buffer, mode="w", engine="h5netcdf")
    for name, dataset in named.items():
        _labelled(dataset).to_netcdf(buffer, mode="a", engine="h5netcdf", group=name)
    with atomic_path(path) as temporary:
        temporary.write_bytes(buffer.getbuffer())
        append_checksum(temporary)


def hdf5_provenance(path: Path) -> Provenance:
    """Return the provenance in the root attributes of an HDF5 artefact, of whatever schema version.

    Raises:
        Exception: One of ``UNREADABLE``: the file is no HDF5 file, or lacks an attribute.
    """
    import xarray as xr

    with xr.open_dataset(path, engine="h5netcdf") as root:
        return read_provenance(root.attrs)


def load(path: Path, kind: str, group: str = ROOT) -> tuple[xr.Dataset, Provenance]:
    """Read one group of an artefact into memory, with its provenance.

    Nothing of the content is used before its checksum, its structure, its kind and version and the
    dimensions, units, types and labels of the group are as they should be.

    Raises:
        DamagedArtefactError: The file was cut off or changed, differs from its schema or is of another
            schema version; the message gives the command that makes it again.
        ArtefactError: The file is missing, or is of another kind.
    """
    import xarray as xr

    provenance = _examined(path, _stamp(path))
    check_identity(path, kind, provenance)
    try:
        with xr.open_dataset(path, engine="h5netcdf", group=group) as dataset:
            check_group(kind, group, dataset)
            dataset.load()
    except UNREADABLE as error:
        raise DamagedArtefactError(path, f"does not follow the schema of kind {kind!r} ({error})") from error
    return dataset, provenance


def _stamp(path: Path) -> tuple[int, ...]:
    """Return what changes whenever a file is replaced or written to; nothing where there is no file."""
    if not path.is_file():
        return ()
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


@lru_cache(maxsize=1024)
def _examined(path: Path, stamp: tuple[int, ...]) -> Provenance:
    """Return the provenance of an artefact that is whole and holds its own data; looked at once a process.

    Raises:
        DamagedArtefactError: It was cut off or changed, or cannot be read.
        ArtefactError: There is no such file, or it may not be read.
    """
    check_whole(path)
    try:
        check_self_contained(path)
        return hdf5_provenance(path)
    except UNREADABLE as error:
        raise DamagedArtefactError(path, f"cannot be read as a swesbi artefact ({error})") from error


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file atomically, indented, in the order given."""
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def check_whole(path: Path, read: Callable[[Path], Provenance] = hdf5_provenance) -> None:
    """Compare an artefact with the checksum at its end.

    Args:
        path: The file.
        read: Reads the provenance of a file that has no checksum, to tell an older one from a damaged one.

    Raises:
        DamagedArtefactError: It differs, has none or is of an older schema version.
        ArtefactError: There is no such file, or it may not be read.
    """
    try:
        if has_checksum(path) or not _is_older(path, read):
            check_bytes(path)
    except FileNotFoundError as error:
        raise ArtefactError(f"{path}: no such file; make it: {repair_command(path)}") from error
    except OSError as error:
        raise ArtefactError(f"{path}: cannot be read ({error.strerror or error})") from error
    except DamagedArtefactError:
        raise
    except ValueError as error:
        raise DamagedArtefactError(path, str(error)) from error


def check_identity(path: Path, kind: str, provenance: Provenance) -> None:
    """Compare what an artefact says of itself with what is expected.

    Raises:
        ArtefactError: It is of another kind.
        DamagedArtefactError: It is of another schema version.
    """
    if provenance.kind != kind:
        raise ArtefactError(f"{path}: holds a {provenance.kind!r} artefact, expected {kind!r}")
    if not OLDEST_READ <= provenance.schema_version <= SCHEMA_VERSION:
        raise DamagedArtefactError(path, _of_version(provenance.schema_version))


def _is_older(path: Path, read: Callable[[Path], Provenance]) -> bool:
    """Tell whether an artefact has no checksum because it was written before there were any.

    Raises:
        DamagedArtefactError: It was, and is no longer read.
    """
    try:
        version = read(path).schema_version
    except UNREADABLE:
        return False
    if version < OLDEST_READ:
        raise DamagedArtefactError(path, _of_version(version))
    return version < SCHEMA_VERSION


def _of_version(version: int) -> str:
    return f"has schema version {version}, this swesbi reads {SCHEMA_VERSION}"


def _labelled(dataset: xr.Dataset) -> xr.Dataset:
    """Give labels and indices the units of what has none."""
    bare = {name: label for name, label in dataset.coords.items() if "units" not in label.attrs}
    return dataset.assign_coords({name: label.assign_attrs(units="1") for name, label in bare.items()})
