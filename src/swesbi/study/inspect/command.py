"""Says in short what files of the study are; compares two runs of it; checks checksums."""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final

from swesbi.artefacts import ArtefactError, DamagedArtefactError
from swesbi.artefacts.files import check_json, check_whole
from swesbi.study.inspect.diff import ArrayDifference, FileDifference, RunDifference, compare_runs
from swesbi.study.inspect.read import FACTS, ORIGIN, READERS, SETTINGS, Array, Content, read
from swesbi.study.job import RUN_WITH

LEFT: Final = frozenset({"file", "array", "units", "meaning"})
DIFFERENCES: Final = ("file", "array", "units", "max abs", "max rel", "meaning")
VERDICTS: Final = "verdict.json"
SHOWN_FILES: Final = 3
HASH_DIGITS: Final = 16
ARTEFACTS: Final = (".h5", ".pt", ".json")
OF_RESULTS: Final = ("logs", "cohort")
"""Folders beside each other in the results of every study."""
ANSWERS: Final = ("new", "change")
"""Folders of what commands answer, for which Snakemake has no rule."""
EXIT_EQUAL: Final = 0
EXIT_DIFFERENT: Final = 1
EXIT_ERROR: Final = 2


def summary(content: Content) -> list[str]:
    """Return what a file is, what made it, and of each array path, dimensions, units and meaning."""
    lines = [f"{content.path}: {content.kind}"]
    lines += [f"  {key}: {value}" for key, value in content.sections.get(ORIGIN, {}).items()]
    if settings := content.sections.get(SETTINGS):
        in_order = json.dumps(dict(settings), sort_keys=True).encode()
        lines.append(f"  settings hash: {hashlib.sha256(in_order).hexdigest()[:HASH_DIGITS]}")
    lines += [f"  {key}: {value}" for key, value in content.sections.get(FACTS, {}).items()]
    return [*lines, *(f"  {_in_words(array)}" for array in content.arrays)]


def _in_words(array: Array) -> str:
    sizes = zip(array.dims, array.values.shape, strict=True)
    dimensions = " x ".join(f"{name} {size}" for name, size in sizes) or "scalar"
    return "  ".join(part for part in (array.name, dimensions, array.units, array.meaning) if part)


def difference_lines(difference: RunDifference) -> list[str]:
    """Return what differs, from what was asked for to what came out: settings, code, verdicts, numbers."""
    files = difference.files
    verdicts = [file for file in files if file.path.name == VERDICTS]
    others = [file for file in files if file.path.name != VERDICTS]
    sections = {
        "only in the first": [str(path) for path in difference.only_first],
        "only in the second": [str(path) for path in difference.only_second],
        "damaged, so not compared": [message for file in files for message in file.damage],
        "settings": _grouped(files, SETTINGS),
        "code and origin": _grouped(files, ORIGIN),
        "verdicts": [
            f"{file.path.parent}: {key}: {one} -> {two}"
            for file in verdicts
            for key, (one, two) in file.changes.get(FACTS, {}).items()
        ],
        "what files say": _grouped(others, FACTS),
        "arrays": _changed_arrays(files),
        "other files whose bytes differ": [str(file.path) for file in files if _is_opaque(file)],
    }
    lines = [f"{difference.common} files in both, {len(files)} of them differ"]
    for title, shown in sections.items():
        lines += [f"{title}:", *(f"  {line}" for line in shown)] if shown else []
    return [*lines, "the runs are equal" if difference.is_empty else "the runs differ"]


def table(rows: Sequence[Sequence[str]], header: Sequence[str]) -> list[str]:
    """Return rows of text as aligned lines below a header, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    return [
        "  ".join(
            text.ljust(width) if name in LEFT else text.rjust(width)
            for text, width, name in zip(row, widths, header, strict=True)
        ).rstrip()
        for row in (header, *rows)
    ]


def _grouped(differences: Iterable[FileDifference], section: str) -> list[str]:
    """Return a line for each change, with the files that have it."""
    files: dict[tuple[str, str, str], list[Path]] = {}
    for file in differences:
        for key, (one, two) in file.changes.get(section, {}).items():
            files.setdefault((key, one, two), []).append(file.path)
    return [f"{key}: {one} -> {two}  ({_named(paths)})" for (key, one, two), paths in files.items()]


def _named(paths: list[Path]) -> str:
    more = f" and {len(paths) - SHOWN_FILES} more" if len(paths) > SHOWN_FILES else ""
    return ", ".join(map(str, paths[:SHOWN_FILES])) + more


def _is_opaque(file: FileDifference) -> bool:
    return not (any(file.changes.values()) or file.arrays or file.damage)


def _changed_arrays(files: Iterable[FileDifference]) -> list[str]:
    rows = [(str(file.path), *_changed_array(array)) for file in files for array in file.arrays]
    return table(rows, DIFFERENCES) if rows else []


def _changed_array(array: ArrayDifference) -> tuple[str, str, str, str, str]:
    numbers = ("", "") if array.note else (f"{array.max_abs:.3g}", f"{array.max_rel:.3g}")
    return (array.name, array.units, *numbers, array.note)


def main(arguments: Sequence[str]) -> int:
    """Run the command.

    Returns:
        0: told, all whole, or equal; 1: the runs differ; 2: a file is missing, damaged or unreadable.
    """
    parser = _parser()
    given = parser.parse_args(arguments)
    if bool(given.files) == bool(given.diff):
        parser.error("name files, or --diff and two folders")
    if given.diff:
        return _compare(*given.diff)
    if given.check:
        return _each(_artefacts_in(given.files), _whole)
    return _each(given.files, lambda path: [*summary(read(path)), ""])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swesbi inspect",
        description="Says what files of the study are, what made them (seed, settings, code, version), "
        f"and which arrays they hold, with dimensions and units. Formats: {', '.join(READERS)}.",
        epilog="Exit code: 0 told, whole or equal; 1 the runs differ; 2 a file is missing, damaged or "
        "cannot be read. The message for a damaged file ends with the command that makes it again.",
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="files of the study")
    parser.add_argument(
        "--diff",
        nargs=2,
        type=Path,
        metavar=("RUN_A", "RUN_B"),
        help="compare the results folders of two runs instead: settings, code, verdicts, arrays",
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="only compare artefacts (.h5, .pt, .json) with their checksums; folders are searched. "
        "Tables and figures have none",
    )
    return parser


def _artefacts_in(paths: Sequence[Path]) -> list[Path]:
    """Return the files given, and the artefacts in the folders given, of which each must hold one."""
    artefacts_found: list[Path] = []
    for path in paths:
        artefacts = (each for each in path.rglob("*") if each.suffix in ARTEFACTS)
        inside = sorted(artefacts) if path.is_dir() else [path]
        if not inside:
            raise ArtefactError(f"{path}: holds no artefact ({', '.join(ARTEFACTS)})")
        artefacts_found += inside
    return artefacts_found


def _whole(path: Path) -> list[str]:
    (check_json if path.suffix == ".json" else check_whole)(path)
    return [f"{path}: whole"]


def _compare(first: Path, second: Path) -> int:
    difference = compare_runs(first, second)
    print("\n".join([f"{first} -> {second}", *difference_lines(difference)]))
    if difference.is_damaged:
        return EXIT_ERROR
    return EXIT_EQUAL if difference.is_empty else EXIT_DIFFERENT


def _told(error: ArtefactError) -> str:
    """Return what is wrong, with a command only for what a study's workflow makes."""
    if not isinstance(error, DamagedArtefactError):
        return str(error)
    path = error.path.absolute()
    folders = [above for above in path.parents if all((above / name).is_dir() for name in OF_RESULTS)]
    if not folders:
        return f"{error.path}: {error.fault}; it is no result of a study, and is left as it is"
    if any(part in ANSWERS for part in path.relative_to(folders[0]).parts):
        return f"{error.path}: {error.fault}; ask again with --force: `swesbi infer --help`"
    return error.message(_options(folders[0]))


def _options(results: Path) -> str:
    """Return what Snakemake was given beside its targets, as the last log of a study says."""
    logs = sorted((results / "logs").rglob("*.log"), key=lambda path: path.stat().st_mtime)
    lines = logs[-1].read_text(encoding="utf-8").splitlines() if logs else []
    return next((line.removeprefix(RUN_WITH) for line in lines if line.startswith(RUN_WITH)), "")


def _each(files: Sequence[Path], lines: Callable[[Path], list[str]]) -> int:
    """Print something of every file; one that cannot be read does not stop the others."""
    status = EXIT_EQUAL
    for path in files:
        try:
            print("\n".join(lines(path)))
        except ArtefactError as error:
            print(f"swesbi: {_told(error)}", file=sys.stderr)
            status = EXIT_ERROR
    return status
