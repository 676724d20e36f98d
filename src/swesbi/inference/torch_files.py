"""Files that torch writes and reads as plain data: state_dicts, texts and numbers, nothing to execute."""

from __future__ import annotations

import io
import pickle
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch

from swesbi.artefacts import ArtefactError, Provenance, atomic_path, read_provenance

Content = TypeVar("Content")


def write_plain(path: Path, content: Mapping[str, Any]) -> None:
    """Write plain content atomically; equal content gives equal bytes."""
    # Saved through memory: given a path, torch writes the file's name into the archive.
    buffer = io.BytesIO()
    torch.save(dict(content), buffer)
    with atomic_path(path) as temporary:
        temporary.write_bytes(buffer.getvalue())


def read_plain(
    path: Path, kind: str, rebuild: Callable[[Mapping[str, Any]], Content]
) -> tuple[Content, Provenance]:
    """Read plain content with ``weights_only=True`` and rebuild from it what it holds.

    Args:
        path: The file; its content has ``metadata`` with the attributes of a provenance.
        kind: The kind that the provenance must name.
        rebuild: Makes the result from the content.

    Raises:
        ArtefactError: The file is not of this kind, or cannot be read or rebuilt by this package.
    """
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
        provenance = read_provenance(content["metadata"])
        if provenance.kind != kind:
            raise ValueError(f"it holds a {provenance.kind!r}")
        return rebuild(content), provenance
    except (
        OSError,
        KeyError,
        TypeError,
        ValueError,
        RuntimeError,
        EOFError,
        pickle.UnpicklingError,
        zipfile.BadZipFile,
    ) as error:
        raise ArtefactError(
            f"{path}: cannot be read as an artefact of kind {kind!r} ({error}); delete it and rerun"
        ) from error
