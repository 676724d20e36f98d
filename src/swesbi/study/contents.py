"""What a file of a study contains, whatever its format: what made it, its settings, its facts, its arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import yaml

from swesbi.artefacts import Array, ArtefactError, DamagedArtefactError, Provenance, files
from swesbi.artefacts.csv import read_csv

ORIGIN: Final = "code and origin"
SETTINGS: Final = "settings"
VERDICTS: Final = "verdicts"
FACTS: Final = "facts"
Sections = dict[str, dict[str, str]]
"""Text by key, below the titles above."""
Content = tuple[Sections, dict[str, Array]]


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


def flatten(plain: object) -> dict[str, str]:
    """Return nested plain data as text by key: ``{"prior": {"low": 2}}`` becomes ``{"prior.low": "2"}``."""
    leaves = _leaves(plain if isinstance(plain, Mapping) else {"": plain})
    return {key: ", ".join(map(str, one if isinstance(one, list | tuple) else [one])) for key, one in leaves}


def _leaves(nested: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in nested.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _artefact(provenance: Provenance) -> Sections:
    made = {key: str(value) for key, value in provenance.attributes().items() if key != SETTINGS}
    made["subject"] = provenance.subject or "whole cohort"
    return {ORIGIN: made, SETTINGS: flatten(provenance.settings)}


def _hdf5(path: Path) -> Content:
    made = files.provenance_of(path)
    arrays = {
        f"{group}/{name}".strip("/"): one
        for group, found in files.read_groups(path).items()
        for name, one in found.items()
    }
    return _artefact(made), arrays


def _table(path: Path) -> Content:
    return {}, {str(name): Array(("row",), column.to_numpy()) for name, column in read_csv(path).items()}


def _plain(path: Path) -> Content:
    text = path.read_text(encoding="utf-8")
    content = json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)
    if isinstance(content, dict) and content.pop(files.CHECKSUM, None):
        files.check_json(path)
    return {VERDICTS if path.name == "verdict.json" else FACTS: flatten(content)}, {}


READERS: Final[Mapping[str, Callable[[Path], Content]]] = {
    ".h5": _hdf5,
    ".csv": _table,
    ".json": _plain,
    ".yaml": _plain,
}
