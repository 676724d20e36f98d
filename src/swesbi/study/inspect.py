"""Summarise files of the study, whatever their format, or verify checksums."""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import yaml

from swesbi.artefacts import Array, ArtefactError, DamagedArtefactError, files
from swesbi.artefacts.atomic import typed
from swesbi.artefacts.csv import read_csv
from swesbi.base.settings import flatten
from swesbi.base.terminal import EXIT_REFUSED
from swesbi.study.job import options_of
from swesbi.study.parsers import ARTEFACTS

OF_RESULTS: Final = ("logs", "cohort")
"""Folders beside each other in the results of every study."""
Content = tuple[dict[str, str], dict[str, Array]]
"""What is said of a file, as text by key, and its arrays by name."""


def main(given: argparse.Namespace) -> int:
    """Run `inspect`; return 0, or 2 if a file is missing, damaged or unreadable."""
    status = 0
    for path in _artefacts_in(given.files) if given.check else given.files:
        try:
            if given.check:
                (files.check_json if path.suffix == ".json" else files.check_whole)(path)
            print(f"{path}: whole" if given.check else summary(path))
        except ArtefactError as error:
            print(f"swesbi: {advised(error)}", file=sys.stderr)
            status = EXIT_REFUSED
    return status


def summary(path: Path) -> str:
    """Return what a file is, what made it, and of each array path, dimensions, units and meaning."""
    facts, arrays = read(path)
    lines = [f"{key}: {value}" for key, value in facts.items()]
    for name, array in arrays.items():
        dimensions = " x ".join(f"{dim} {size}" for dim, size in array.sizes.items()) or "scalar"
        parts = (name, dimensions, array.attrs.get("units"), array.attrs.get("long_name"))
        lines.append("  ".join(filter(None, parts)))
    return "\n  ".join([str(path), *lines])


def _artefacts_in(paths: Sequence[Path]) -> Iterator[Path]:
    """Yield the files given, and the artefacts in the folders given, each of which must have one."""
    for path in paths:
        inside = sorted(path.rglob("*")) if path.is_dir() else [path]
        if not (artefacts := [each for each in inside if each.suffix in ARTEFACTS]):
            raise ArtefactError(f"{path}: no artefact ({', '.join(ARTEFACTS)})")
        yield from artefacts


def advised(error: Exception) -> str:
    """Return what is wrong with a file, and the command that makes it again where one is known."""
    if not isinstance(error, DamagedArtefactError):
        return str(error)
    # they take seconds to import, and a file that is whole needs none of it
    from swesbi.answers.files import OBSERVATION
    from swesbi.study.compare import CHANGES

    path, again = error.path.absolute(), ""
    above = (each for each in path.parents if all((each / name).is_dir() for name in OF_RESULTS))
    if results := next(above, None):
        _, *inside = path.relative_to(results).parts
        if inside[:1] != [CHANGES]:
            return error.message(options_of(results / "logs"))
        whose = ("--person", inside[1]) if len(inside) > 2 else ("--all",)
        again = typed("swesbi", "compare", "--cohort", "FOLDER", *whose)
    elif (path.parent / OBSERVATION).is_file():
        subject = ("--subject", path.parent.name, "--out", path.parents[1])
        again = typed("swesbi", "infer", "FOLDER", *subject, "--force")
    remedy = f"with FOLDER of the recordings: {again}" if again else "it is no result of a study"
    return f"{error.path}: {error.fault}; {remedy}"


def read(path: Path) -> Content:
    """Return what a file contains, once its checksum, if it has one, is known to be right."""
    try:
        path.open("rb").close()
        if path.suffix not in READERS:
            raise ArtefactError(f"{path}: is of none of the formats shown: {', '.join(READERS)}")
        return READERS[path.suffix](path)
    except (FileNotFoundError, IsADirectoryError, PermissionError) as error:
        raise ArtefactError(f"{path}: cannot be read ({error.strerror})") from error
    except ArtefactError:
        raise
    except (*files.UNREADABLE, yaml.YAMLError) as error:
        raise DamagedArtefactError(path, f"cannot be read as {path.suffix} ({error})") from error


def _hdf5(path: Path) -> Content:
    made = files.provenance_of(path)
    said = {key: str(value) for key, value in made.attributes().items() if key != "settings"}
    said["subject"] = made.subject or "whole cohort"
    if settings := flatten(made.settings):
        digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
        said["settings hash"] = digest[:16]
    arrays = {
        f"{group}/{name}".strip("/"): one
        for group, found in files.read_groups(path).items()
        for name, one in found.items()
    }
    return said, arrays


def _table(path: Path) -> Content:
    return {}, {str(name): Array(("row",), column.to_numpy()) for name, column in read_csv(path).items()}


def _plain(path: Path) -> Content:
    text = path.read_text(encoding="utf-8")
    content = json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)
    if isinstance(content, dict) and content.pop(files.CHECKSUM, None):
        files.check_json(path)
    return flatten(content), {}


READERS: Final[Mapping[str, Callable[[Path], Content]]] = {
    ".h5": _hdf5,
    ".csv": _table,
    ".json": _plain,
    ".yaml": _plain,
}
