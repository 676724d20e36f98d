"""Comparing every artefact of a run with its checksum."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from swesbi.artefacts import ArtefactError

ARTEFACTS: Final = (".h5", ".pt")


def artefacts_in(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the files given, and the artefacts in the folders given.

    Raises:
        ArtefactError: A folder holds none.
    """
    found: list[Path] = []
    for path in paths:
        inside = (
            sorted(each for each in path.rglob("*") if each.suffix in ARTEFACTS) if path.is_dir() else [path]
        )
        if not inside:
            raise ArtefactError(f"{path}: holds no artefact ({', '.join(ARTEFACTS)})")
        found += inside
    return tuple(found)
