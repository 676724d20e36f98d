"""The guard of results sees every change of an array, column, key or figure, and follows renames."""

from pathlib import Path

import guard
import h5py
import numpy as np
import pytest


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
    one, same, other = (
        made(tmp_path / "1"),
        made(tmp_path / "2"),
        made(tmp_path / "3", np.nextafter(2.0, 3.0)),
    )
    before = guard.hashes(one)
    assert not any(guard.differences(before, guard.hashes(same)).values())
    assert guard.differences(before, guard.hashes(other)) == {
        "missing": [],
        "new": [],
        "different": [
            "figure.png::", "posterior.h5::draws/theta", "table.csv::median", "verdict.json::z",
        ],
    }  # fmt: skip


def test_a_renamed_dataset_is_followed_and_an_unsaid_one_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, now = guard.hashes(made(tmp_path / "1")), guard.hashes(made(tmp_path / "2", dataset="phi"))
    found = guard.differences(before, now)
    assert (found["missing"], found["new"]) == (["posterior.h5::draws/theta"], ["posterior.h5::draws/phi"])
    monkeypatch.setattr(guard, "RENAMED", ((r"(.*)::draws/theta", r"\1::draws/phi"),))
    assert not any(guard.differences(before, now).values())
    monkeypatch.setattr(guard, "RENAMED", ())
    monkeypatch.setattr(guard, "LEFT_OUT", (r".*::draws/theta",))
    assert guard.differences(before, now)["missing"] == []
