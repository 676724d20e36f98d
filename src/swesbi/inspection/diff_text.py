"""The differences between two runs as text on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from swesbi.inspection.diff import ArrayDifference, FileDifference, RunDifference
from swesbi.inspection.text import table

VERDICTS: Final = "support.json"
HEADER: Final = ("file", "array", "units", "max abs", "max rel", "meaning")
SHOWN_FILES: Final = 3


def difference_lines(difference: RunDifference) -> list[str]:
    """Return what differs, from what was asked for to what came out: settings, code, verdicts, numbers."""
    files = difference.files
    sections = {
        "only in the first": [str(path) for path in difference.only_first],
        "only in the second": [str(path) for path in difference.only_second],
        "settings": _grouped((file.path, file.settings) for file in files),
        "code and origin": _grouped((file.path, file.origin) for file in files),
        "verdicts": _verdicts(files),
        "what files say": _grouped((file.path, file.facts) for file in files if not _is_verdict(file)),
        "arrays": _arrays(files),
        "other files whose bytes differ": [str(file.path) for file in files if _is_opaque(file)],
    }
    lines = [f"{difference.common} files in both, {len(files)} of them differ"]
    for title, shown in sections.items():
        lines += [f"{title}:", *(f"  {line}" for line in shown)] if shown else []
    return [*lines, "the runs are equal" if difference.is_empty else "the runs differ"]


def _grouped(changes: Iterable[tuple[Path, Mapping[str, tuple[str, str]]]]) -> list[str]:
    """Return a line for each change, with the files that have it."""
    files: dict[tuple[str, str, str], list[Path]] = {}
    for path, changed in changes:
        for key, (one, two) in changed.items():
            files.setdefault((key, one, two), []).append(path)
    return [f"{key}: {one} -> {two}  ({_named(paths)})" for (key, one, two), paths in files.items()]


def _named(paths: list[Path]) -> str:
    more = f" and {len(paths) - SHOWN_FILES} more" if len(paths) > SHOWN_FILES else ""
    return ", ".join(map(str, paths[:SHOWN_FILES])) + more


def _verdicts(files: Iterable[FileDifference]) -> list[str]:
    return [
        f"{file.path.parent}: {key}: {one} -> {two}"
        for file in files
        if _is_verdict(file)
        for key, (one, two) in file.facts.items()
    ]


def _is_verdict(file: FileDifference) -> bool:
    return file.path.name == VERDICTS


def _is_opaque(file: FileDifference) -> bool:
    return not (file.settings or file.origin or file.facts or file.arrays)


def _arrays(files: Iterable[FileDifference]) -> list[str]:
    rows = [(str(file.path), *_row(array)) for file in files for array in file.arrays]
    return table(rows, HEADER) if rows else []


def _row(array: ArrayDifference) -> tuple[str, str, str, str, str]:
    numbers = ("", "") if array.note else (f"{array.max_abs:.3g}", f"{array.max_rel:.3g}")
    return (array.name, array.units, *numbers, array.note)
