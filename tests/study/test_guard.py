"""The guard of results sees every change of an array, column, key or figure."""

from pathlib import Path

import guard
import h5py
import numpy as np


def made(folder: Path, value: float = 2.0, dataset: str = "theta") -> Path:
    """Write a folder of results in which one number, or one name, may differ."""
    folder.mkdir()
    with h5py.File(folder / "posterior.h5", "w") as file:
        file.attrs["code"] = str(folder)  # how it was made does not count
        file[f"draws/{dataset}"] = np.array([1.0, value])
        file["subject"] = np.array(["A", "B"], dtype=h5py.string_dtype())
    (folder / "table.csv").write_text(f"subject,median\nA,{value}\n")
    (folder / "verdict.json").write_text(f'{{"status": "doubtful", "z": {value}}}')
    (folder / "figure.png").write_bytes(bytes(str(value), "ascii"))
    return folder


def test_equal_results_are_equal_and_one_other_number_is_found_wherever_it_stands(tmp_path: Path) -> None:
    before = guard.hashes(made(tmp_path / "1"))
    assert not any(guard.differences(before, guard.hashes(made(tmp_path / "2"))).values())
    different = ["figure.png::", "posterior.h5::draws/theta", "table.csv::median", "verdict.json::z"]
    other = guard.hashes(made(tmp_path / "3", np.nextafter(2.0, 3.0)))
    assert guard.differences(before, other) == {"missing": [], "new": [], "different": different}
    renamed = guard.differences(before, guard.hashes(made(tmp_path / "4", dataset="phi")))
    assert renamed["missing"] == ["posterior.h5::draws/theta"]
    assert renamed["new"] == ["posterior.h5::draws/phi"]
