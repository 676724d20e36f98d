"""The files of a run of the study that are its results."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.artefacts import ArtefactError

BESIDE: Final = frozenset({"logs", "benchmarks"})
DATED: Final = frozenset({"snakemake-report.html"})


def results_of(folder: Path) -> tuple[Path, ...]:
    """Return the results in a folder, relative to it and sorted; no logs, timings or dated reports.

    Raises:
        ArtefactError: It is no folder, or has no results.
    """
    if not folder.is_dir():
        raise ArtefactError(f"{folder}: no such folder; name the results folder of a run")
    found = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    results = tuple(sorted(path for path in found if _is_result(path)))
    if not results:
        raise ArtefactError(f"{folder}: holds no results; name the results folder of a run")
    return results


def _is_result(path: Path) -> bool:
    hidden = any(part.startswith(".") for part in path.parts)
    return not hidden and path.parts[0] not in BESIDE and path.name not in DATED
