"""Kinds of files that people have: each is read rightly, or refused with its place and what to do."""

from __future__ import annotations

import re
import shutil
import warnings
from pathlib import Path

import free_case
import pytest
import yaml
from cohorts import snapshot, write_cohort, write_overlay
from kinds import GATED, KINDS, OK, SUBJECTS, cell, scaled
from rules import ingest_one
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.answers.files import RecordingRequest
from swesbi.config.read import ConfigError
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.recording.tables import csv_text

OF_S1 = re.compile("(subjects|gated|MATLAB|files|descriptions) 0|.*(of the phases are|S-1.csv: is reached)")
FAULTS_OF_S1 = [name for name in KINDS if OF_S1.match(name)]
"""Kinds of each file: inference and ingestion read by the functions by which validation does."""


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cohort without a fault, to be copied."""
    return free_case.mixed(tmp_path_factory.mktemp("good") / "cohort")


def broken(name: str, good: Path, folder: Path) -> tuple[str, Path]:
    """What is to be said of a kind, and a copy of the good cohort that is of it."""
    change, message = KINDS[name]
    cohort = Path(shutil.copytree(good, folder / "cohort"))
    change(cohort)
    return message, cohort


def shown_by(capsys: pytest.CaptureFixture[str], message: str) -> str:
    """What was printed on the error stream, which says these words and, behind them, what to do."""
    shown = capsys.readouterr().err
    assert "Traceback" not in shown
    found = re.search(message, shown)
    assert found and "; " in shown[found.start() :], shown
    return shown


@pytest.mark.parametrize("name", KINDS)
def test_it_is_read_or_refused_in_words_and_nothing_is_written(
    name: str, good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message, cohort = broken(name, good, tmp_path)
    sheets = [] if message.startswith(OK) else ["--plot", str(tmp_path / "sheets")]
    before = snapshot(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code = main(["validate", str(cohort), *sheets])
    if not message.startswith(OK):
        assert code == 2
        shown_by(capsys, message)
    else:
        shown = capsys.readouterr()
        assert code == 0, shown.err
        assert "3 recordings can be used" in shown.out
        assert re.search(message.removeprefix(OK), shown.out), shown.out
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize("name", FAULTS_OF_S1)
def test_inference_and_ingestion_refuse_it_and_write_nothing(
    name: str,
    good: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is not wrong would be answered."""

    def not_here(*_: object, **__: object) -> None:
        raise ValueError("not answered in this test")

    monkeypatch.setattr(RecordingRequest, "answer_into", not_here)
    message, cohort = broken(name, good, tmp_path)
    before = snapshot(cohort)
    assert main(["infer", str(cohort), "--from-prior", "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err
    assert re.search(message, shown.err + shown.out)
    changes = write_overlay(tmp_path / "changes.yaml", cohort, subjects=["S-1"])
    with pytest.raises((ConfigError, RecordingError), match=message):
        ingest_one(changes, "S-1", tmp_path / "results" / "observation.h5")
    assert snapshot(cohort) == before
    assert not list(tmp_path.rglob("*.h5"))


def test_no_sign_of_a_file_reaches_the_terminal_that_cannot_be_printed(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of columns and names of files that nobody reads, and of a column that is proposed."""
    cohort = Path(shutil.copytree(good, tmp_path / "cohort"))
    clears = "\x1b[2J\x9b"
    (cohort / "swe" / f"{clears}.csv").touch()
    path = cohort / "swe" / "S-1.csv"
    header, rest = path.read_text().split("\n", 1)
    assert main(["validate", str(cohort)]) == 0
    path.write_text(f"{clears}'{header}\n{rest}")
    assert main(["validate", str(cohort)]) == 2
    assert main(["template", "--like", str(path)]) == 0
    shown = capsys.readouterr()
    assert (shown.err + shown.out).count(r"\x1b[2J\x9b") >= 3
    assert (shown.err + shown.out).replace("\n", "").isprintable()
    proposed = yaml.safe_load(shown.out[shown.out.index("# Columns of") :])
    assert f"{clears}'{header.split(',')[0]}" in proposed["columns"].values()


def test_all_problems_are_listed_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    cell(SUBJECTS, "sex", "x")(cohort)
    cell(GATED, "rr_ms", "1", row=7)(cohort)
    cell(GATED, "status", "fine", row=9)(cohort)
    (cohort / "swe" / "s_2x.csv").unlink()
    (cohort / "recording.yaml").write_text("origin:\n")
    assert main(["validate", str(cohort)]) == 2
    shown = shown_by(capsys, "cohort: 5 problems")
    for place in ("row 2, column 'sex'", "row 7, column 'rr_ms'", "row 9, column 'status'", "s_2x", "origin"):
        assert place in shown


def test_a_fault_of_every_row_is_told_in_a_few_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    scaled("rr_ms", 0.001, GATED)(cohort)
    assert main(["validate", str(cohort)]) == 2
    shown = shown_by(capsys, "likewise in 715 more rows, the last of them 721: is outside")
    assert len(shown.splitlines()) == 9


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"subjects": ["S-1", "Q"]}, "'subjects': 'Q' is no subject of .*which has S-1, s_2x; correct"),
        ({"subjects": ["../../x"]}, "subjects"),
        ({"subjects": ["a/b"]}, "subjects"),
        ({"subjects": [""]}, "subjects"),
        (
            {"experiments": {"calibrated": {"subjects": ["s_2x", "Z"]}}},
            "'experiments.calibrated.subjects': 'Z' is no.*write `experiments.calibrated.subjects: all`",
        ),
    ],
)
def test_a_subject_that_only_the_configuration_knows_is_named_with_its_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], said: dict[str, object], message: str
) -> None:
    changes = write_overlay(tmp_path / "changes.yaml", write_cohort(tmp_path / "cohort"), **said)
    assert main(["validate", str(tmp_path / "cohort"), "--overlay", str(changes)]) == 2
    shown = capsys.readouterr().err
    assert re.search(message, shown) and "Traceback" not in shown
    assert "experiments.paper" not in shown  # its list is of another cohort


def test_an_unreadable_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cohort = write_cohort(tmp_path / "cohort")

    def denied(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", denied)
    with pytest.raises(RecordingError, match=r"S-1.csv: cannot be read \(Permission denied\); check"):
        read_samples(cohort / "swe" / "S-1.csv", 20, 1000.0)


def test_a_file_beyond_reason_is_refused_before_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    monkeypatch.setattr(csv_text, "MAX_BYTES", 1024)
    with pytest.raises(RecordingError, match="S-1.csv: has 0 MiB, the limit is 0; keep one row per sample"):
        read_samples(cohort / "swe" / "S-1.csv", 20, 1000.0)


def test_phases_that_were_typed_are_blamed_where_they_were_typed(
    good: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", str(good), "--phases", "12"]) == 2
    shown = capsys.readouterr().err
    assert "protocol.phases is 20, but --phases is 12; correct the one that is wrong" in shown
    assert "config.yaml" not in shown
