"""What `inspect` says of a file of a study, and of two runs."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from study_copy import StudyCopy

from swesbi.artefacts import ArtefactError, write_json
from swesbi.artefacts.files import LENGTH, append_checksum
from swesbi.study.inspect.command import main
from swesbi.study.inspect.diff import compare_arrays, compare_runs
from swesbi.study.inspect.read import Array, flatten

Shown = pytest.CaptureFixture[str]


@pytest.fixture
def runs(finished: StudyCopy, tmp_path: Path) -> tuple[Path, Path]:
    """The results of a finished study, and a copy to be changed."""
    shutil.copytree(finished.results, tmp_path / "other")
    return finished.results, tmp_path / "other"


def test_a_summary_says_what_a_file_is_what_made_it_and_which_arrays_it_holds(
    finished: StudyCopy, capsys: Shown
) -> None:
    path = finished.results / "paper" / "subjects" / "A" / "posterior.h5"
    assert main([str(path), str(finished.results / "paper" / "estimator.pt")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{path}: posterior"
    with h5py.File(path) as file:
        shape, label = file["posterior/k0_kpa"].shape, file["posterior/k0_kpa"].attrs["long_name"]
        assert f"  seed: {int(file.attrs['seed'][0])}" in lines
        assert f"  code hash: {file.attrs['code_hash']}" in lines
    assert any(re.fullmatch("  settings hash: [0-9a-f]{16}", line) for line in lines)
    assert f"  posterior/k0_kpa  chain {shape[0]} x draw {shape[1]}  kPa  {label}" in lines
    assert any(line.startswith("  state_dict/net._transform") for line in lines)


def test_a_file_that_cannot_be_shown_does_not_hide_the_others(
    finished: StudyCopy, tmp_path: Path, capsys: Shown
) -> None:
    good = finished.results / "cohort" / "A" / "passive.h5"
    cut = tmp_path / "cut.h5"
    cut.write_bytes(good.read_bytes()[:-200])
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "notes.txt").touch()
    names = ["nowhere.h5", "broken.json", "notes.txt"]
    assert main([str(cut), *(str(tmp_path / name) for name in names), str(good)]) == 2
    shown = capsys.readouterr()
    assert "cut.h5: has no checksum at its end: it was cut off" in shown.err
    assert "it is no result of a study, and is left as it is" in shown.err
    assert "rm -f" not in shown.err
    assert "nowhere.h5: no such file" in shown.err
    assert "broken.json: cannot be read as JSON" in shown.err
    assert "notes.txt: .txt is not among the formats shown: .h5, .pt, .csv, .json, .yaml" in shown.err
    assert f"{good}: passive" in shown.out


def test_check_compares_every_artefact_with_its_checksum(runs: tuple[Path, Path], capsys: Shown) -> None:
    _, other = runs
    assert main(["--check", str(other)]) == 0
    whole = capsys.readouterr().out.splitlines()
    assert len(whole) == len([path for ending in ("h5", "pt", "json") for path in other.rglob(f"*.{ending}")])
    shard = other / "simulations" / "paper" / "A" / "shard-0.h5"
    content = bytearray(shard.read_bytes())
    content[5000] ^= 1
    shard.write_bytes(content)
    assert main(["--check", str(other)]) == 2
    shown = capsys.readouterr()
    assert len(shown.out.splitlines()) == len(whole) - 1
    assert f"{shard}: does not match its checksum" in shown.err
    assert "delete it and rerun: rm -f" in shown.err


@pytest.mark.parametrize("arguments", [[], ["a.h5", "--diff", "b", "c"]])
def test_a_wrong_call_is_explained(arguments: list[str], capsys: Shown) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "name files, or --diff and two folders" in capsys.readouterr().err


def test_equal_runs_are_equal(runs: tuple[Path, Path], capsys: Shown) -> None:
    first, other = runs
    (other / "logs" / "extra.log").write_text("logs do not count")
    assert main(["--diff", str(first), str(other)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "the runs are equal"


def change_attribute(path: Path, change: Callable[[h5py.File], None]) -> None:
    path.write_bytes(path.read_bytes()[:-LENGTH])
    with h5py.File(path, "a") as file:
        change(file)
    append_checksum(path)


def test_differences_of_settings_code_arrays_and_verdicts_are_told(
    runs: tuple[Path, Path], capsys: Shown
) -> None:
    first, other = runs

    def change(file: h5py.File) -> None:
        settings = json.loads(file.attrs["settings"])
        settings["passive"]["exponent_b"] = 4.0
        file.attrs["settings"] = json.dumps(settings, sort_keys=True)
        file.attrs["code_hash"] = "0123456789abcdef"
        file["scale_kpa"][()] *= 1.01

    change_attribute(other / "cohort" / "A" / "passive.h5", change)
    verdict = other / "paper" / "subjects" / "F" / "verdict.json"
    content = json.loads(verdict.read_text())
    before = content["status"]
    verdict.write_text(json.dumps({**content, "status": "another"}))
    (other / "figures" / "ppc.png").write_bytes(b"another")
    (other / "tables" / "ppc.csv").unlink()
    (other / "extra.csv").write_text("a\n1\n")
    assert main(["--diff", str(first), str(other)]) == 1
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    sections = {title: lines.index(title) for title in ("settings:", "code and origin:", "verdicts:")}
    assert lines[sections["settings:"] + 1] == "passive.exponent_b: 3.0 -> 4.0  (cohort/A/passive.h5)"
    assert "-> 0123456789abcdef  (cohort/A/passive.h5)" in lines[sections["code and origin:"] + 1]
    assert lines[sections["verdicts:"] + 1] == f"paper/subjects/F: status: {before} -> another"
    row = next(line.split() for line in lines if line.startswith("cohort/A/passive.h5"))
    assert row[1:3] == ["scale_kpa", "kPa"]
    assert float(row[4]) == pytest.approx(0.01 / 1.01, rel=0.01)
    assert "figures/ppc.png" in lines
    assert lines[lines.index("only in the first:") + 1] == "tables/ppc.csv"
    assert lines[lines.index("only in the second:") + 1] == "extra.csv"
    assert lines[-1] == "the runs differ"


def test_a_damaged_file_does_not_end_the_comparison(
    runs: tuple[Path, Path], tmp_path: Path, capsys: Shown
) -> None:
    first, other = runs
    cut = other / "cohort" / "A" / "passive.h5"
    cut.write_bytes(cut.read_bytes()[:-200])
    (other / "tables" / "ppc.csv").write_bytes(b"\xff\xfe")
    (other / "tables" / "posterior.csv").unlink()
    verdict = other / "paper" / "subjects" / "F" / "verdict.json"
    verdict.write_text(json.dumps({**json.loads(verdict.read_text()), "status": "changed"}))
    assert main(["--diff", str(first), str(other)]) == 2
    shown = capsys.readouterr()
    lines = [line.strip() for line in shown.out.splitlines()]
    damaged = lines.index("damaged, so not compared:")
    assert lines[damaged + 1].startswith(f"{cut}: has no checksum at its end: it was cut off")
    assert "rm -f" in lines[damaged + 1]
    assert lines[damaged + 2].startswith(f"{other / 'tables' / 'ppc.csv'}: cannot be read as a table")
    assert lines[lines.index("only in the first:") + 1] == "tables/posterior.csv"
    assert lines[lines.index("verdicts:") + 1].endswith("-> changed")
    assert "other files whose bytes differ:" not in lines
    assert lines[-1] == "the runs differ"


def test_damage_in_both_runs_is_told_of_both(tmp_path: Path, capsys: Shown) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "broken.json").write_text("{" + name)
        (tmp_path / name / "same.json").write_text("{")
    assert main(["--diff", str(tmp_path / "one"), str(tmp_path / "two")]) == 2
    shown = capsys.readouterr().out
    assert "2 files in both, 1 of them differ" in shown
    for name in ("one", "two"):
        assert f"{tmp_path / name / 'broken.json'}: cannot be read as JSON" in shown


def test_a_folder_is_told_from_a_file_that_is_missing(tmp_path: Path, capsys: Shown) -> None:
    assert main([str(tmp_path)]) == 2
    shown = capsys.readouterr().err
    assert f"{tmp_path}: is a folder; " in shown
    assert f"swesbi inspect --check {tmp_path}" in shown
    assert "no such file" not in shown


def test_what_is_no_run_is_named(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(ArtefactError, match="nowhere: no such folder; name the results folder"):
        compare_runs(tmp_path / "nowhere", tmp_path)
    with pytest.raises(ArtefactError, match="empty: holds no results"):
        compare_runs(tmp_path / "empty", tmp_path)


def numbers(*values: float, units: str = "kPa") -> Array:
    return Array("a", ("n",), np.array(values), units)


def texts(*values: str) -> Array:
    return Array("a", ("n",), np.array(values))


@pytest.mark.parametrize(
    ("one", "two", "expected"),
    [
        (numbers(1.0, np.nan), numbers(1.0, np.nan), None),
        (numbers(0.0, np.inf), numbers(-0.0, np.inf), None),
        (numbers(1.0, 4.0), numbers(1.0, 5.0), (1.0, 0.2)),
        (numbers(0.0, 4.0), numbers(1e-9, 5.0), (1.0, 1.0)),
        (numbers(1.0), numbers(np.nan), "1 values are missing in one alone"),
        (numbers(1.0), numbers(1.0, 2.0), r"\('n',\) of \(1,\) against \('n',\) of \(2,\)"),
        (numbers(1.0), numbers(1.0, units="Pa"), "'kPa' against 'Pa'"),
        (texts("x", "y"), texts("x", "zz"), "1 texts differ"),
        (texts("x"), texts("x"), None),
        (Array("a", (), np.array(True)), Array("a", (), np.array(False)), (1.0, 1.0)),
    ],
)
def test_arrays_are_compared_in_numbers(
    one: Array, two: Array, expected: tuple[float, float] | str | None
) -> None:
    found = compare_arrays(one, two)
    if expected is None or found is None:
        assert found is expected
    elif isinstance(expected, str):
        assert re.search(expected, found.note)
    else:
        assert (found.max_abs, found.max_rel) == pytest.approx(expected)
        assert not found.note


def test_nested_settings_become_dotted_keys() -> None:
    plain = {"prior": {"low": 2}, "levels": [0.5, 0.9], "runs": [{"seed": 1}], "none": None}
    assert flatten(plain) == {"prior.low": "2", "levels": "0.5, 0.9", "runs[0].seed": "1", "none": "None"}


def test_what_is_advised_depends_on_whose_file_it_is(tmp_path: Path, capsys: Shown) -> None:
    results = tmp_path / "results"
    own, answer = (
        results / "paper" / "pool.h5",
        results / "amortised" / "new" / "clinic" / "S-1" / "posterior.h5",
    )
    raw = tmp_path / "data" / "raw.h5"
    for folder in (results / "logs", results / "cohort", own.parent, answer.parent, raw.parent):
        folder.mkdir(parents=True, exist_ok=True)
    for path, advice in (
        (own, "delete it and rerun: rm -f"),
        (answer, "ask again with --force: `swesbi infer --help`"),
        (raw, "it is no result of a study, and is left as it is"),
    ):
        path.write_bytes(b"not HDF5")
        assert main(["--check", str(path)]) == 2
        shown = capsys.readouterr().err
        assert advice in shown
        assert ("rm -f" in shown) == (path == own)


def test_a_changed_json_is_found(tmp_path: Path, capsys: Shown) -> None:
    path = tmp_path / "verdict.json"
    write_json(path, {"status": "strained", "k_hat": 0.3})
    assert main(["--check", str(path)]) == 0
    path.write_text(path.read_text().replace("strained", "contradicted"))
    assert main(["--check", str(path)]) == 2
    assert "does not match its checksum" in capsys.readouterr().err
