"""Which experiment and subject a result belongs to, by where it lies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from swesbi.artefacts import ArtefactError

FOLDER = "subjects"


class ResultKey(NamedTuple):
    """Where a per-subject result lies: ``<experiment>/subjects/<subject>/<file>``."""

    experiment: str
    subject: str


def result_key(path: Path) -> ResultKey:
    """Return the experiment and the subject of a per-subject result.

    Raises:
        ArtefactError: The file does not lie in an experiment's folder of a subject.
    """
    folders = path.parts[-4:-1]
    if len(folders) < 3 or folders[1] != FOLDER:
        raise ArtefactError(f"{path}: expected <experiment>/{FOLDER}/<subject>/{path.name}")
    return ResultKey(folders[0], folders[2])


def by_key(paths: Sequence[Path]) -> dict[ResultKey, Path]:
    """Return results by experiment and subject, in the order given.

    Raises:
        ArtefactError: Two files are of the same subject and experiment.
    """
    keys = {result_key(path): path for path in paths}
    if len(keys) < len(paths):
        raise ArtefactError(f"{paths[0]} and others: two files of the same subject and experiment")
    return keys


def by_subject(paths: Sequence[Path]) -> dict[str, Path]:
    """Return results that belong to no experiment (``cmaes/<subject>.h5``) by subject."""
    return {path.stem: path for path in paths}


def pick(paths: dict[ResultKey, Path], key: ResultKey, what: str) -> Path:
    """Return one subject's file.

    Raises:
        ArtefactError: There is none.
    """
    if key not in paths:
        raise ArtefactError(f"no {what} of subject {key.subject} in experiment {key.experiment!r} is given")
    return paths[key]
