"""What differs between two runs of the study."""

from __future__ import annotations

import filecmp
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.artefacts import ArtefactError
from swesbi.study.inspect.read import READERS, Array, Content, read

ABSENT: Final = "(none)"
BESIDE: Final = frozenset({"logs"})
DATED: Final = frozenset({"snakemake-report.html"})
Changes = Mapping[str, tuple[str, str]]


@dataclass(frozen=True)
class ArrayDifference:
    """One array that differs: by how much, or in which way if it cannot be said in numbers."""

    name: str
    max_abs: float = float("nan")
    max_rel: float = float("nan")
    units: str = ""
    note: str = ""


@dataclass(frozen=True)
class FileDifference:
    """One file that both runs have and that differs.

    Attributes:
        path: Relative to the folder of the run.
        changes: Key -> what each run has, by the sections of ``Content``.
        arrays: The arrays that differ.
        damage: Why it was not compared: a message for each of the two that cannot be read.
    """

    path: Path
    changes: Mapping[str, Changes] = field(default_factory=dict)
    arrays: tuple[ArrayDifference, ...] = ()
    damage: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunDifference:
    """Two runs: files that only one has, and files that differ."""

    common: int
    only_first: tuple[Path, ...]
    only_second: tuple[Path, ...]
    files: tuple[FileDifference, ...]

    @property
    def is_empty(self) -> bool:
        """Whether the runs have the same files with the same content."""
        return not (self.only_first or self.only_second or self.files)

    @property
    def is_damaged(self) -> bool:
        """Whether files that differ could not be compared."""
        return any(file.damage for file in self.files)


def compare_runs(first: Path, second: Path) -> RunDifference:
    """Compare the results of two runs, file by file; one that cannot be read does not stop the others.

    Raises:
        ArtefactError: A folder has no results.
    """
    one, two = _results_of(first), _results_of(second)
    common = [path for path in one if path in two]
    compared = [_compare_files(path, first / path, second / path) for path in common]
    return RunDifference(
        common=len(common),
        only_first=tuple(path for path in one if path not in two),
        only_second=tuple(path for path in two if path not in one),
        files=tuple(difference for difference in compared if difference),
    )


def compare_arrays(one: Array, two: Array) -> ArrayDifference | None:
    """Return how two arrays of one name differ, or None if they do not.

    The relative difference is |a - b| / max(|a|, |b|), so it is at most 2; missing values are equal to
    missing values.
    """
    if one.dims != two.dims or one.values.shape != two.values.shape:
        return ArrayDifference(one.name, note=f"{_shape(one)} against {_shape(two)}")
    if one.units != two.units:
        return ArrayDifference(one.name, note=f"{one.units!r} against {two.units!r}")
    if not (one.is_numeric and two.is_numeric):
        differing = int((one.values.astype(str) != two.values.astype(str)).sum())
        return ArrayDifference(one.name, note=f"{differing} texts differ") if differing else None
    return _compare_numbers(one, two)


def _compare_numbers(one: Array, two: Array) -> ArrayDifference | None:
    a, b = one.values.astype(np.float64), two.values.astype(np.float64)
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    if same.all():
        return None
    if lost := int((np.isfinite(a) != np.isfinite(b)).sum()):
        return ArrayDifference(one.name, units=one.units, note=f"{lost} values are missing in one alone")
    gap = np.abs(a - b)[~same]
    relative = gap / np.maximum(np.abs(a), np.abs(b))[~same]
    return ArrayDifference(one.name, float(gap.max()), float(relative.max()), one.units)


def _results_of(folder: Path) -> dict[Path, None]:
    """Return the results in a folder, relative to it and sorted; no logs, timings or dated reports."""
    if not folder.is_dir():
        raise ArtefactError(f"{folder}: no such folder; name the results folder of a run")
    files = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    if not (results := dict.fromkeys(path for path in files if _is_result(path))):
        raise ArtefactError(f"{folder}: holds no results; name the results folder of a run")
    return results


def _is_result(path: Path) -> bool:
    hidden = any(part.startswith(".") for part in path.parts)
    return not hidden and path.parts[0] not in BESIDE and path.name not in DATED


def _compare_files(name: Path, first: Path, second: Path) -> FileDifference | None:
    """Compare two files; of formats that are not read, whether their bytes differ is all there is to say."""
    try:
        if filecmp.cmp(first, second, shallow=False):
            return None
    except OSError as error:
        return FileDifference(name, damage=(str(error),))
    if name.suffix not in READERS:
        return FileDifference(name)
    one, two = _content(first), _content(second)
    if isinstance(one, str) or isinstance(two, str):
        return FileDifference(name, damage=tuple(each for each in (one, two) if isinstance(each, str)))
    changes = {title: _changed(facts, two.sections.get(title, {})) for title, facts in one.sections.items()}
    return FileDifference(name, changes, _compare_all(one.arrays, two.arrays))


def _content(path: Path) -> Content | str:
    """Return what a file holds, or why it cannot be read."""
    try:
        return read(path)
    except (ArtefactError, OSError) as error:
        return str(error)


def _compare_all(one: tuple[Array, ...], two: tuple[Array, ...]) -> tuple[ArrayDifference, ...]:
    first, second = ({array.name: array for array in arrays} for arrays in (one, two))
    differences = [compare_arrays(first[name], second[name]) for name in first if name in second]
    alone = [
        *(ArrayDifference(name, note="only in the first") for name in first if name not in second),
        *(ArrayDifference(name, note="only in the second") for name in second if name not in first),
    ]
    return (*(difference for difference in differences if difference), *alone)


def _changed(one: Mapping[str, str], two: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    pairs = {key: (one.get(key, ABSENT), two.get(key, ABSENT)) for key in {**one, **two}}
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}


def _shape(array: Array) -> str:
    return f"{array.dims} of {array.values.shape}"
