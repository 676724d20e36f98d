"""What differs between two runs of the study."""

from __future__ import annotations

import filecmp
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.inspection.content import Array
from swesbi.inspection.read import READERS, read
from swesbi.inspection.runs import results_of

ABSENT: Final = "(none)"


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
        settings: Key -> what each run has.
        origin: Version, code hash, seed: what each run has.
        facts: What else the files say of themselves, the verdicts among them.
        arrays: The arrays that differ.
    """

    path: Path
    settings: Mapping[str, tuple[str, str]]
    origin: Mapping[str, tuple[str, str]]
    facts: Mapping[str, tuple[str, str]]
    arrays: tuple[ArrayDifference, ...]


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


def compare_runs(first: Path, second: Path) -> RunDifference:
    """Compare the results of two runs, file by file.

    Raises:
        ArtefactError: A folder has no results, or a file cannot be read.
    """
    one, two = results_of(first), results_of(second)
    common = sorted({*one} & {*two})
    return RunDifference(
        common=len(common),
        only_first=tuple(path for path in one if path not in {*two}),
        only_second=tuple(path for path in two if path not in {*one}),
        files=tuple(
            compare_files(path, first / path, second / path)
            for path in common
            if not filecmp.cmp(first / path, second / path, shallow=False)
        ),
    )


def compare_files(name: Path, first: Path, second: Path) -> FileDifference:
    """Compare two files whose bytes differ; of formats that are not read, that is all there is to say."""
    if name.suffix not in READERS:
        return FileDifference(name, {}, {}, {}, ())
    one, two = read(first), read(second)
    return FileDifference(
        path=name,
        settings=_changed(one.settings, two.settings),
        origin=_changed(one.origin, two.origin),
        facts=_changed(one.facts, two.facts),
        arrays=_compare_all(one.arrays, two.arrays),
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


def _compare_all(one: tuple[Array, ...], two: tuple[Array, ...]) -> tuple[ArrayDifference, ...]:
    first, second = ({array.name: array for array in arrays} for arrays in (one, two))
    found = [compare_arrays(first[name], second[name]) for name in first if name in second]
    alone = [
        *(ArrayDifference(name, note="only in the first") for name in first if name not in second),
        *(ArrayDifference(name, note="only in the second") for name in second if name not in first),
    ]
    return (*(difference for difference in found if difference), *alone)


def _changed(one: Mapping[str, str], two: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    pairs = {key: (one.get(key, ABSENT), two.get(key, ABSENT)) for key in {**one, **two}}
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}


def _shape(array: Array) -> str:
    return f"{array.dims} of {array.values.shape}"
