"""Files that torch writes and reads as plain data: state_dicts, texts and numbers, nothing to execute."""

from __future__ import annotations

import io
import pickle
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import torch

from swesbi.artefacts import DamagedArtefactError, Provenance, atomic_path, read_provenance
from swesbi.artefacts.files import LENGTH, UNREADABLE, append_checksum, check_identity, check_whole
from swesbi.inference.plain_content import check_plain

Content = TypeVar("Content")
COMMENT_LENGTH: Final = slice(-2, None)
"""The last two bytes of a zip archive without a comment: the length of the comment."""
NOT_PLAIN: Final = (*UNREADABLE, EOFError, pickle.UnpicklingError, zipfile.BadZipFile)


def write_plain(path: Path, content: Mapping[str, Any]) -> None:
    """Write plain content atomically, with a checksum as the archive's comment; equal content, equal bytes.

    Raises:
        ArtefactError: The file cannot be written.
    """
    # Saved through memory: given a path, torch writes the file's name into the archive.
    buffer = io.BytesIO()
    torch.save(dict(content), buffer)
    archive = bytearray(buffer.getvalue())
    archive[COMMENT_LENGTH] = LENGTH.to_bytes(2, "little")
    with atomic_path(path) as temporary:
        temporary.write_bytes(archive)
        append_checksum(temporary)


def read_plain(
    path: Path, kind: str, rebuild: Callable[[Mapping[str, Any]], Content]
) -> tuple[Content, Provenance]:
    """Read plain content with ``weights_only=True`` and rebuild from it what it holds.

    Torch reads a flipped bit without complaint, so the checksum comes first; then the content has to be
    plain, of this kind and of this schema version before anything is built from it.

    Args:
        path: The file; its content has ``metadata`` with the attributes of a provenance.
        kind: The kind that the provenance must name.
        rebuild: Makes the result from the content.

    Raises:
        DamagedArtefactError: The file was cut off or changed, is of another schema version, is not plain or
            cannot be rebuilt; the message gives the command that makes it again.
        ArtefactError: The file is missing, or is of another kind.
    """
    check_whole(path, plain_provenance)
    content, provenance = _guarded(path, kind, lambda: _content(path))
    check_identity(path, kind, provenance)
    return _guarded(path, kind, lambda: rebuild(content)), provenance


def read_content(path: Path) -> Mapping[str, Any]:
    """Return the plain content of a file, of whatever kind and version: ``metadata`` and weights.

    Raises:
        Exception: One of ``NOT_PLAIN``: the file is no such file.
    """
    if not zipfile.is_zipfile(path):
        raise ValueError("it is no archive of tensors")
    return check_plain(torch.load(path, map_location="cpu", weights_only=True))


def _content(path: Path) -> tuple[Mapping[str, Any], Provenance]:
    content = read_content(path)
    return content, read_provenance(content["metadata"])


def plain_provenance(path: Path) -> Provenance:
    """Return the provenance of a file of weights, of whatever schema version.

    Raises:
        ValueError: The file is no such file.
    """
    try:
        return _content(path)[1]
    except NOT_PLAIN as error:
        raise ValueError(str(error)) from error


def _guarded(path: Path, kind: str, read: Callable[[], Content]) -> Content:
    try:
        return read()
    except NOT_PLAIN as error:
        raise DamagedArtefactError(
            path, f"cannot be read as an artefact of kind {kind!r} ({error})"
        ) from error
