"""Reading and writing artefacts: netCDF-compatible HDF5, and JSON; where an artefact comes from.

At the end of an artefact stands its checksum, SHA-256 of every byte before it: HDF5 does not notice a flipped
bit in the arrays. It ignores what follows its own content, so files with this line at their end open
everywhere, and without this package
``head -c -80 FILE | sha256sum`` gives what ``tail -c 80 FILE`` says.

An HDF5 file holds its own data and no more of it than it has bytes: nothing else is read through it.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import h5py

from swesbi import __version__
from swesbi.artefacts.atomic import ArtefactError, DamagedArtefactError, atomic_path, repair_command
from swesbi.artefacts.groups import ROOT, Group, attributes_of, group_of, is_dimension_alone

SCHEMA_VERSION = 2
"""Raised whenever what a file holds changes; files of another version are refused."""
UNREADABLE = (OSError, KeyError, TypeError, ValueError, RuntimeError)
CHECKSUM: Final = "sha256"
PREFIX: Final = b"\nswesbi sha256 "
LENGTH: Final = len(PREFIX) + 64 + 1
NO_CHECKSUM: Final = "has no checksum at its end: it was cut off, or written or changed by other software"
CHANGED: Final = "does not match its checksum: its content has changed since it was written"
BLOCK: Final = 1 << 20
DEEPEST: Final = 2


@dataclass(frozen=True)
class Provenance:
    """The root attributes of an artefact; no timestamp, so the same inputs give the same file.

    ``subject`` is empty for what belongs to the whole cohort; ``settings`` are those that the stage used.
    The class of a file names the ``kind``, which is empty until then.
    """

    kind: str
    subject: str = ""
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    code_hash: str = ""
    package_version: str = __version__
    schema_version: int = SCHEMA_VERSION

    def attributes(self) -> dict[str, str | int]:
        """Return the attributes as HDF5 stores them: settings as key-sorted JSON."""
        return {
            "kind": self.kind,
            "schema_version": self.schema_version,
            "subject": self.subject,
            "seed": self.seed,
            "settings": json.dumps(dict(self.settings), sort_keys=True),
            "package_version": self.package_version,
            "code_hash": self.code_hash,
        }


def read_provenance(attributes: Mapping[str, Any]) -> Provenance:
    """Rebuild the provenance from an artefact's root attributes."""
    return Provenance(
        kind=str(attributes["kind"]),
        subject=str(attributes["subject"]),
        seed=int(attributes["seed"]),
        settings=json.loads(attributes["settings"]),
        code_hash=str(attributes["code_hash"]),
        package_version=str(attributes["package_version"]),
        schema_version=int(attributes["schema_version"]),
    )


@contextmanager
def open_hdf5(path: Path) -> Iterator[h5py.File]:
    """Open an HDF5 file to be read, through Python: so the HDF5 library locks nothing.

    Files are replaced whole, some file systems have no locks, and this process may hold the file open.
    """
    with path.open("rb") as opened, h5py.File(opened, "r") as file:
        yield file


def hdf5_provenance(path: Path) -> Provenance:
    """Return the provenance in the root attributes of an HDF5 artefact, of whatever schema version.

    An error is one of ``UNREADABLE``.
    """
    with open_hdf5(path) as file:
        return read_provenance(attributes_of(file))


def read_groups(path: Path) -> dict[str, Group]:
    """Return all groups of an HDF5 file by name, its root first; an error is one of ``UNREADABLE``."""
    names = [ROOT]
    with open_hdf5(path) as file:
        file.visit(names.append)
        return {name: group_of(file[name]) for name in names if isinstance(file[name], h5py.Group)}


def provenance_of(path: Path) -> Provenance:
    """Return the provenance of an HDF5 artefact, once it is known to be whole and to hold its own data."""
    status = path.stat() if path.is_file() else None
    # which changes whenever the file is replaced or written to
    stamp = status and (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
    return _examined(path, stamp)


@lru_cache(maxsize=1024)
def _examined(path: Path, stamp: tuple[int, ...] | None) -> Provenance:
    """Return the provenance of an artefact that is whole and holds its own data; looked at once a process."""
    check_whole(path)
    try:
        with open_hdf5(path) as file:
            _check_links(file, path.stat().st_size)
            return read_provenance(attributes_of(file))
    except UNREADABLE as error:
        raise DamagedArtefactError(path, f"cannot be read as a swesbi artefact ({error})") from error


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file atomically, indented, in the order given, its checksum last."""
    whole = {**content, CHECKSUM: _checksum(content)}
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(whole, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def check_whole(path: Path) -> None:
    """Compare an artefact with the checksum at its end; without one it is damaged."""
    try:
        stated = stated_checksum(path)
        if stated and stated == _digest(path, path.stat().st_size - LENGTH):
            return
    except FileNotFoundError as error:
        raise ArtefactError(f"{path}: no such file; make it: {repair_command(path)}") from error
    except OSError as error:
        raise ArtefactError(f"{path}: cannot be read ({error.strerror or error})") from error
    raise DamagedArtefactError(path, CHANGED if stated else NO_CHECKSUM)


def check_identity(path: Path, kind: str, provenance: Provenance) -> None:
    """Compare what an artefact says of itself with what is expected."""
    if provenance.kind != kind:
        raise ArtefactError(f"{path}: holds a {provenance.kind!r} artefact, expected {kind!r}")
    if (version := provenance.schema_version) != SCHEMA_VERSION:
        raise DamagedArtefactError(path, f"has schema version {version}, this swesbi reads {SCHEMA_VERSION}")


def check_json(path: Path) -> None:
    """Compare a file of :func:`write_json` with the checksum in it."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        stated = content.pop(CHECKSUM)
    except (OSError, ValueError, AttributeError, KeyError) as error:
        raise ArtefactError(f"{path}: is no JSON with a checksum, so what it says is not checked") from error
    if stated != _checksum(content):
        raise DamagedArtefactError(path, CHANGED)


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def append_checksum(path: Path) -> None:
    """Add the checksum of a file at its end."""
    line = PREFIX + _digest(path, path.stat().st_size).encode() + b"\n"
    with path.open("ab") as file:
        file.write(line)


def stated_checksum(path: Path) -> str:
    """Return the checksum that a file has at its end, right or wrong; empty where it has none."""
    with path.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - LENGTH))
        line = file.read()
    if len(line) < LENGTH or not (line.startswith(PREFIX) and line.endswith(b"\n")):
        return ""
    return line[len(PREFIX) : -1].decode(errors="replace")


def _digest(path: Path, length: int) -> str:
    """Return the hexadecimal SHA-256 of the first ``length`` bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while length > 0 and (block := file.read(min(BLOCK, length))):
            digest.update(block)
            length -= len(block)
    return digest.hexdigest()


def _check_links(group: h5py.Group, size: int, depth: int = 0) -> None:
    """Refuse an HDF5 file of this size before any of its arrays is read.

    It may not lead to other files, name a thing twice, nest deeper than an artefact does or claim more data
    than it has bytes.
    """
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
