"""The results of a study as arrays, to compare two runs."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np


def arrays(file: Path) -> dict[str, np.ndarray]:
    """Return every array of an artefact, as text or numbers; of other files, the bytes."""
    if file.suffix == ".h5":
        with h5py.File(file) as content:
            names: list[str] = []
            content.visit(names.append)
            return {name: content[name][()] for name in names if isinstance(content[name], h5py.Dataset)}
    return {"bytes": np.frombuffer(file.read_bytes(), dtype=np.uint8)}


def artefacts(results: Path) -> list[Path]:
    """Return every result but logs and timings, relative to the results folder; hidden files count."""
    files = (path.relative_to(results) for path in results.rglob("*") if path.is_file())
    return sorted(path for path in files if path.parts[0] != "logs")


def assert_equal_results(one: Path, two: Path) -> int:
    """Compare two results folders array by array; return how many files they hold."""
    assert artefacts(one) == artefacts(two)
    return assert_part_of(one, two)


def assert_part_of(part: Path, whole: Path) -> int:
    """Compare what one results folder holds with the same in another; return how many files."""
    names = artefacts(part)
    for name in names:
        first, second = arrays(part / name), arrays(whole / name)
        assert first.keys() == second.keys()
        for key in first:
            np.testing.assert_array_equal(first[key], second[key], err_msg=f"{name}: {key}")
    return len(names)
