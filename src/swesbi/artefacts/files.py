"""Reading and writing artefacts: netCDF-compatible HDF5, and JSON.

At the end of an artefact stands its checksum, SHA-256 of every byte before it: neither HDF5 nor torch
notices a flipped bit in the arrays. HDF5 ignores what follows its own content and a zip archive has room for
a comment, so files with this line at their end open everywhere, and without this package
``head -c -80 FILE | sha256sum`` gives what ``tail -c 80 FILE`` says.

An HDF5 file holds its own data and no more of it than it has bytes: nothing else is read through it.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import h5py

from swesbi.artefacts.atomic import ArtefactError, DamagedArtefactError, atomic_path, repair_command
from swesbi.artefacts.groups import ROOT, Group, as_netcdf, attributes_of, group_of, is_dimension_alone
from swesbi.artefacts.provenance import OLDEST_READ, SCHEMA_VERSION, Provenance, read_provenance
from swesbi.artefacts.schema import check_group, check_groups

UNREADABLE = (OSError, KeyError, TypeError, ValueError, RuntimeError)
CHECKSUM: Final = "sha256"
PREFIX: Final = b"\nswesbi sha256 "
DIGITS: Final = 64
LENGTH: Final = len(PREFIX) + DIGITS + 1
BLOCK: Final = 1 << 20
DEEPEST: Final = 2
OTHER_LOCK: Final = "flag values don't match"
"""In what the library says of a file that this process holds open under another kind of lock."""


def save(path: Path, groups: Mapping[str, Group], provenance: Provenance) -> None:
    """Write groups to the HDF5 file ``path``, atomically, with a checksum at its end.

    Args:
        path: File to write; its folder is made if need be.
        groups: The group "/" is the root.
        provenance: Becomes the root attributes.

    Raises:
        ArtefactError: A dataset of the schema is missing or differs from it, or the file cannot be written.
    """
    try:
        check_groups(provenance.kind, groups)
    except ValueError as error:
        raise ArtefactError(f"{path}: {error}") from error
    root = groups.get(ROOT, Group({}))
    whole = {**groups, ROOT: replace(root, attrs={**root.attrs, **provenance.attributes()})}
    content = as_netcdf(whole)
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)
        append_checksum(temporary)


def open_hdf5(path: Path) -> h5py.File:
    """Open an HDF5 file to be read, without a lock: files are replaced whole; some file systems have none.

    A file that this process holds open under some kind of lock opens again under that kind alone.

    Raises:
        OSError: It is no HDF5 file, or cannot be read.
    """
    for locking in (False, "best-effort"):
        try:
            return h5py.File(path, "r", locking=locking)
        except OSError as error:
            if OTHER_LOCK not in str(error):
                raise
    return h5py.File(path, "r", locking=True)


def hdf5_provenance(path: Path) -> Provenance:
    """Return the provenance in the root attributes of an HDF5 artefact, of whatever schema version.

    Raises:
        Exception: One of ``UNREADABLE``: the file is no HDF5 file, or lacks an attribute.
    """
    with open_hdf5(path) as file:
        return read_provenance(attributes_of(file))


def load(path: Path, kind: str, group: str = ROOT) -> tuple[Group, Provenance]:
    """Read one group of an artefact into memory, with its provenance.

    Nothing of the content is used before its checksum, its structure, its kind and version and the
    dimensions, units, types and labels of the group are as they should be.

    Raises:
        DamagedArtefactError: The file was cut off or changed, differs from its schema or is of another
            schema version; the message gives the command that makes it again.
        ArtefactError: The file is missing, or is of another kind.
    """
    provenance = provenance_of(path)
    check_identity(path, kind, provenance)
    try:
        dataset = read_group(path, group)
        check_group(kind, group, dataset)
    except UNREADABLE as error:
        raise DamagedArtefactError(path, f"does not follow the schema of kind {kind!r} ({error})") from error
    return dataset, provenance


def group_names(path: Path) -> list[str]:
    """Return the names of all groups of an HDF5 file, its root first.

    Raises:
        OSError: It is no HDF5 file, or cannot be read.
    """
    found: list[str] = []
    with open_hdf5(path) as file:
        file.visit(found.append)
        return [ROOT, *(name for name in found if isinstance(file[name], h5py.Group))]


def read_group(path: Path, group: str = ROOT) -> Group:
    """Return a group of an HDF5 file.

    Raises:
        Exception: One of ``UNREADABLE``: the file is no such HDF5 file, or has no such group.
    """
    with open_hdf5(path) as file:
        return group_of(file[group])


def provenance_of(path: Path) -> Provenance:
    """Return the provenance of an artefact, once it is known to be whole.

    Raises:
        DamagedArtefactError: It was cut off or changed, or cannot be read.
        ArtefactError: There is no such file, or it may not be read.
    """
    return _examined(path, _stamp(path))


def _stamp(path: Path) -> tuple[int, ...]:
    """Return what changes whenever a file is replaced or written to; nothing where there is no file."""
    if not path.is_file():
        return ()
    status = path.stat()
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


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
    """Write a JSON file atomically, indented, in the order given, its checksum last."""
    whole = {**content, CHECKSUM: _checksum(content)}
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(whole, indent=2, allow_nan=False) + "\n", encoding="utf-8")


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


def check_json(path: Path) -> None:
    """Compare a file of :func:`write_json` with the checksum in it.

    Raises:
        ArtefactError: It cannot be read, or has no checksum.
        DamagedArtefactError: It has changed since it was written.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        stated = content.pop(CHECKSUM)
    except (OSError, ValueError, AttributeError, KeyError) as error:
        raise ArtefactError(f"{path}: is no JSON with a checksum, so what it says is not checked") from error
    if stated != _checksum(content):
        fault = "does not match its checksum: its content has changed since it was written"
        raise DamagedArtefactError(path, fault)


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def append_checksum(path: Path) -> None:
    """Add the checksum of a file at its end."""
    line = PREFIX + _digest(path, path.stat().st_size) + b"\n"
    with path.open("ab") as file:
        file.write(line)


def stated_checksum(path: Path) -> str:
    """Return the checksum that a file has at its end; empty where it has none."""
    return (_stated(path) or b"").decode()


def has_checksum(path: Path) -> bool:
    """Tell whether a file ends with a checksum, right or wrong."""
    return _stated(path) is not None


def check_bytes(path: Path) -> None:
    """Compare a file with the checksum at its end.

    Raises:
        ValueError: There is none, so the file is cut off or not this package's, or it differs.
        OSError: The file cannot be read.
    """
    stated = _stated(path)
    if stated is None:
        raise ValueError(
            "has no checksum at its end: it was cut off, or written or changed by other software"
        )
    if stated != _digest(path, path.stat().st_size - LENGTH):
        raise ValueError("does not match its checksum: its content has changed since it was written")


def _stated(path: Path) -> bytes | None:
    """Return the digest that the end of the file states."""
    with path.open("rb") as file:
        if file.seek(0, os.SEEK_END) < LENGTH:
            return None
        file.seek(-LENGTH, os.SEEK_END)
        line = file.read()
    if not (line.startswith(PREFIX) and line.endswith(b"\n")):
        return None
    return line[len(PREFIX) : -1]


def _digest(path: Path, length: int) -> bytes:
    """Return the hexadecimal SHA-256 of the first ``length`` bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while length > 0 and (block := file.read(min(BLOCK, length))):
            digest.update(block)
            length -= len(block)
    return digest.hexdigest().encode()


def check_self_contained(path: Path) -> None:
    """Look at the structure of an HDF5 file before any of its arrays is read.

    Raises:
        ValueError: It leads to other files, names a thing twice, nests deeper than an artefact does or
            claims more data than it has bytes.
        OSError: It is no HDF5 file.
    """
    with open_hdf5(path) as file:
        _check_links(file, path.stat().st_size, depth=0)


def _check_links(group: h5py.Group, size: int, depth: int) -> None:
    if depth > DEEPEST:
        raise ValueError(f"the group {group.name} is nested too deeply")
    for name in group:
        where = f"{group.name.rstrip('/')}/{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"{where} is a link to elsewhere")
        item = group[name]
        if isinstance(item, h5py.Group):
            _check_links(item, size, depth + 1)
        elif isinstance(item, h5py.Dataset):
            _check_extent(where, item, size)
        else:
            raise ValueError(f"{where} is neither a group nor a dataset")


def _check_extent(where: str, dataset: h5py.Dataset, size: int) -> None:
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"{where} takes its data from another file")
    # a dimension without labels is an empty dataset, of which only the length is used
    if dataset.nbytes > size and not is_dimension_alone(dataset):
        raise ValueError(f"{where} claims {dataset.nbytes} bytes of data in a file of {size}")
