"""What `inspect` states of a file of a study."""

from __future__ import annotations

import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from numpy.typing import NDArray
from study_copy import StudyCopy

from swesbi.artefacts import Array, Artefact, ArtefactError, Group, Provenance, Variable, write_json
from swesbi.study import inspect, parsers
from swesbi.study.inspect import READERS, read

Shown = pytest.CaptureFixture[str]
FIT, TABLE = Path("cohort/A/fit.h5"), Path("tables/ppc.csv")
VERDICT, FIGURE = Path("paper/subjects/F/verdict.json"), Path("figures/ppc.png")


@dataclass(frozen=True)
class Inspected(Artefact, kind="inspected"):
    k0_kpa: Annotated[NDArray[np.float64], Variable("draw", "kPa", "stiffness")]


def main(arguments: list[str]) -> int:
    return inspect.main(parsers.inspect().parse_args(arguments))


def write_fit(path: Path) -> None:
    """Write an artefact of which two groups differ in the length of a dimension."""
    draws = Array(("draw",), np.arange(3.0), {"units": "kPa", "long_name": "stiffness"})
    few = Array(("draw",), np.array([0, 1]))
    made = Provenance(Inspected.kind, "A", 7, {"passive": {"exponent_b": 3.0}}, "abc")
    Inspected.save(path, {"/": Group({"k0_kpa": draws}), "few": Group({"index": few})}, made)


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Path, Path]:
    """The results of a run, with a file of every format, and a copy to be changed."""
    first = tmp_path / "results"
    for path in (TABLE, FIGURE, Path("logs/ingest/A.log")):
        (first / path).parent.mkdir(parents=True)
    write_fit(first / FIT)
    write_json(first / VERDICT, {"status": "doubtful", "k_hat": 0.3})
    (first / TABLE).write_text("name,value\na,1\nb,\n")
    (first / FIGURE).write_bytes(b"figure")
    (first / "configuration.yaml").write_text("levels: [0.5, 0.9]\n")
    (first / "logs/ingest/A.log").write_text("run with: --configfile small.yaml\n")
    shutil.copytree(first, tmp_path / "other")
    return first, tmp_path / "other"


def test_a_summary_states_what_a_file_is_what_made_it_and_which_arrays_it_contains(
    runs: tuple[Path, Path], capsys: Shown
) -> None:
    fit, table = runs[0] / FIT, runs[0] / TABLE
    assert main([str(fit), str(table), str(runs[0] / VERDICT)]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert lines[lines.index(str(fit)) + 1] == "kind: inspected"
    assert {"subject: A", "seed: 7", "code_hash: abc", "schema_version: 2"} <= set(lines)
    assert sum(re.fullmatch("settings hash: [0-9a-f]{16}", line) is not None for line in lines) == 1
    assert {"k0_kpa  draw 3  kPa  stiffness", "few/index  draw 2"} <= set(lines)
    assert lines[lines.index(str(table)) + 1 :][:2] == ["name  row 2", "value  row 2"]
    assert lines[-2:] == ["status: doubtful", "k_hat: 0.3"]


def test_every_file_of_a_study_can_be_read(finished: StudyCopy) -> None:
    for path in finished.results.rglob("*"):
        if path.suffix in READERS:
            read(path)


def test_a_file_that_cannot_be_shown_does_not_hide_the_others(
    runs: tuple[Path, Path], tmp_path: Path, capsys: Shown
) -> None:
    good, cut = runs[0] / FIT, tmp_path / "cut.h5"
    cut.write_bytes(good.read_bytes()[:-200])
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "notes.txt").touch()
    names = ["cut.h5", "nowhere.h5", "broken.json", "notes.txt", "results"]
    assert main([*(str(tmp_path / name) for name in names), str(good)]) == 2
    shown = capsys.readouterr()
    reasons = ("cut off", "No such file", "as .json", "none of the formats", "directory")
    for line, name, why in zip(shown.err.splitlines(), names, reasons, strict=True):
        assert f"{name}: " in line and why in line
    assert "it is no result of a study" in shown.err and "rm -f" not in shown.err
    assert str(good) in shown.out


def test_check_compares_every_artefact_with_its_checksum(runs: tuple[Path, Path], capsys: Shown) -> None:
    _, other = runs
    assert main(["--check", str(other)]) == 0
    assert capsys.readouterr().out.splitlines() == [f"{other / path}: whole" for path in (FIT, VERDICT)]
    content = bytearray((other / FIT).read_bytes())
    content[5000] ^= 1
    (other / FIT).write_bytes(content)
    (other / VERDICT).write_text((other / VERDICT).read_text().replace("doubtful", "contradicted"))
    assert main(["--check", str(other)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    for line, path in zip(shown.err.splitlines(), (FIT, VERDICT), strict=True):
        assert f" {other / path}: " in line and "does not match its checksum" in line
    with pytest.raises(ArtefactError, match="logs: no artefact"):
        main(["--check", str(other / "logs")])


@pytest.mark.parametrize(
    ("path", "advice"),
    [
        ("results/paper/change/P1/S-1/posterior.h5", "compare --cohort FOLDER --person P1"),
        ("results/paper/change/changes_groups.h5", "compare --cohort FOLDER --all"),
        ("answers/clinic/S-1/posterior.h5", "infer FOLDER --subject S-1 --out answers/clinic --force"),
    ],
)
def test_the_message_ends_with_the_command_that_makes_the_file_again(
    runs: tuple[Path, Path], capsys: Shown, monkeypatch: pytest.MonkeyPatch, path: str, advice: str
) -> None:
    monkeypatch.chdir(runs[0].parent)
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent))  # where a shell knows it, by its name
    Path(path).parent.mkdir(parents=True)
    Path(path).with_name("observation.h5").touch()
    Path(path).write_bytes(b"not HDF5")
    assert main(["--check", path]) == 2
    assert capsys.readouterr().err.endswith(f"{advice}\n")
