"""What every artefact says of itself, of whatever schema version: integrity and provenance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from swesbi.artefacts import Provenance
from swesbi.artefacts.files import UNREADABLE, check_whole, has_checksum
from swesbi.artefacts.provenance import SCHEMA_VERSION
from swesbi.inspection.content import Array, Content, flatten
from swesbi.inspection.words import kind_in_words


def integrity(path: Path, read: Callable[[Path], Provenance]) -> str:
    """Return what the checksum of an artefact says.

    Args:
        path: The artefact.
        read: Reads the provenance of an artefact without a checksum; raises one of ``UNREADABLE``.

    Raises:
        ArtefactError: The file was cut off or changed.
    """
    if not has_checksum(path) and (version := _version(path, read)) < SCHEMA_VERSION:
        return f"no checksum (schema version {version}, before checksums); this swesbi does not use it"
    check_whole(path, read)
    return "checksum right"


def described(path: Path, checked: str, provenance: Provenance, arrays: tuple[Array, ...]) -> Content:
    """Return an artefact with its provenance in words."""
    origin = {
        "subject": provenance.subject or "whole cohort",
        "seed": str(provenance.seed),
        "swesbi": provenance.package_version,
        "code hash": provenance.code_hash or "not recorded",
        "schema version": str(provenance.schema_version),
    }
    what = kind_in_words(provenance.kind)
    return Content(path, what, checked, origin, flatten(dict(provenance.settings)), {}, arrays)


def _version(path: Path, read: Callable[[Path], Provenance]) -> int:
    try:
        return read(path).schema_version
    except UNREADABLE:
        return SCHEMA_VERSION
