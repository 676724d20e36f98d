"""Shows what files of the study hold and how they were made; compares two runs; checks checksums."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.files import check_whole
from swesbi.inspection.diff import compare_runs
from swesbi.inspection.read import READERS, read
from swesbi.inspection.text import as_lines, difference_lines

ARTEFACTS: Final = (".h5", ".pt")
EXIT_EQUAL: Final = 0
EXIT_DIFFERENT: Final = 1
EXIT_ERROR: Final = 2


def main(arguments: Sequence[str]) -> int:
    """Run the command.

    Returns:
        0: shown, all whole, or equal; 1: the runs differ; 2: a file is missing, damaged or unreadable.
    """
    parser = _parser()
    given = parser.parse_args(arguments)
    if bool(given.files) == bool(given.diff):
        parser.error("name files, or --diff and two folders")
    if given.diff:
        return _compare(*given.diff)
    if given.check:
        return _each(_artefacts_in(given.files), _whole)
    return _each(given.files, lambda path: [*as_lines(read(path)), ""])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m swesbi inspect",
        description="Shows what files of the study are, how they were made (settings, seed, code, version), "
        f"and their arrays with dimensions, units and statistics. Formats: {', '.join(READERS)}.",
        epilog="Exit code: 0 shown, whole or equal; 1 the runs differ; 2 a file is missing, damaged or "
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
        help="only compare artefacts (.h5, .pt) with their checksums; folders are searched",
    )
    return parser


def _artefacts_in(paths: Sequence[Path]) -> list[Path]:
    """Return the files given, and the artefacts in the folders given, of which each must hold one."""
    found: list[Path] = []
    for path in paths:
        artefacts = (each for each in path.rglob("*") if each.suffix in ARTEFACTS)
        inside = sorted(artefacts) if path.is_dir() else [path]
        if not inside:
            raise ArtefactError(f"{path}: holds no artefact ({', '.join(ARTEFACTS)})")
        found += inside
    return found


def _whole(path: Path) -> list[str]:
    check_whole(path)
    return [f"{path}: whole"]


def _compare(first: Path, second: Path) -> int:
    difference = compare_runs(first, second)
    print("\n".join([f"{first} -> {second}", *difference_lines(difference)]))
    if difference.is_damaged:
        return EXIT_ERROR
    return EXIT_EQUAL if difference.is_empty else EXIT_DIFFERENT


def _each(files: Sequence[Path], lines: Callable[[Path], list[str]]) -> int:
    """Print something of every file; one that cannot be read does not stop the others."""
    status = EXIT_EQUAL
    for path in files:
        try:
            print("\n".join(lines(path)))
        except ArtefactError as error:
            print(f"swesbi: {error}", file=sys.stderr)
            status = EXIT_ERROR
    return status
