"""A good cohort is summed up and drawn; a new one is started from a template."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cohorts import ROWS, recording, snapshot, write_cohort
from recordings import RECORDING
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.cohort.subjects import read_subjects
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import REASONS
from swesbi.report.figures.recording import draw_recording_sheet
from swesbi.report.numbers import REJECTIONS


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_the_summary_says_what_quality_control_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    assert main(["validate", str(cohort)]) == 0
    lines = capsys.readouterr().out.splitlines()
    report = examine_cohort(cohort, RECORDING, 100)
    for subject in report.subjects:
        observed = subject.observation
        cells = next(line for line in lines if line.startswith(observed.subject)).split()
        assert cells[1] == "20/20"
        assert int(cells[2]) == observed.samples_accepted.sum()
        assert int(cells[3]) == observed.samples_rejected.sum() == (subject.verdict >= 0).sum()
        assert cells[4] == f"{np.median(observed.speed_se_m_s / observed.speed_m_s):.1%}"
        samples = read_samples(cohort / f"swe/{observed.subject}.csv", 20, 1e3)
        assert f"no_wave {(samples.status == 'no_wave').sum()}," in " ".join(cells) + ","


def test_a_recording_that_no_subject_claims_is_named_before_the_others_are_summed_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    recording(5).to_csv(cohort / "swe" / "spare.csv", index=False)
    (cohort / "swe" / "_example.csv").write_text("of the template")
    assert main(["validate", str(cohort)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[1].startswith("warning: ") and said[1].endswith("subjects.csv does not name them: spare.csv")
    (cohort / "swe" / f"{next(iter(ROWS))}.csv").unlink()
    assert main(["validate", str(cohort)]) == 2
    assert "subjects.csv does not name them: spare.csv" in capsys.readouterr().err


def test_sheets_are_drawn_and_nothing_else_is_written(tmp_path: Path) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    before = snapshot(cohort)
    assert main(["validate", str(cohort), "--plot", str(tmp_path / "sheets")]) == 0
    assert snapshot(cohort) == before
    assert {path.name for path in (tmp_path / "sheets").iterdir()} == {f"{subject}.png" for subject in ROWS}


def test_a_sheet_shows_every_sample() -> None:
    report = examine_cohort(ROOT / "data" / "virtual_volunteers", RECORDING, 100)
    subject = next(one for one in report.subjects if one.observation.subject == "B")
    figure = draw_recording_sheet(subject, report.origin)
    assert "virtual volunteers" in figure.get_suptitle()
    lines = {str(line.get_label()): line for line in figure.axes[0].get_lines()}
    assert len(lines["accepted sample"].get_xdata()) == (subject.verdict == -1).sum()
    for index, reason in enumerate(REASONS):
        label = f"rejected: {REJECTIONS[reason][0].lower()}{REJECTIONS[reason][1:]}"
        drawn = len(lines[label].get_xdata()) if label in lines else 0
        assert drawn == (subject.verdict == index).sum()


def test_a_template_becomes_a_cohort_when_it_is_filled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new" / "cohort"
    assert main(["template", str(folder)]) == 0
    assert main(["validate", str(folder)]) == 2
    shown = capsys.readouterr().err
    assert "subjects.csv: holds no data row" in shown
    assert "has no text under the key `origin`" in shown
    with (folder / "subjects.csv").open("a") as table:
        table.write("S01,F,31,1.71,62,95,36,0.82\n")
    header = (folder / "swe" / "_example.csv").read_text()
    (folder / "swe" / "S01.csv").write_text(header + recording().to_csv(index=False, header=False))
    text = (folder / "recording.yaml").read_text()
    (folder / "recording.yaml").write_text(text.replace("origin:", "origin: a test"))
    assert main(["validate", str(folder)]) == 0


def test_the_examples_in_the_template_are_valid(tmp_path: Path) -> None:
    assert main(["template", str(tmp_path / "cohort")]) == 0
    table = tmp_path / "cohort" / "subjects.csv"
    table.write_text(table.read_text().replace("# S01", "S01").replace("\nsubject", "\n#subject"))
    lines = table.read_text().splitlines()
    table.write_text("\n".join([lines[-1].removeprefix("#"), *lines[:-1]]))
    assert read_subjects(table)[0].subject == "S01"
    example = tmp_path / "cohort" / "swe" / "_example.csv"
    lines = example.read_text().splitlines()
    example.write_text("\n".join([lines[-1], *(line.replace("# 0,26", "0,26") for line in lines[:-1])]))
    assert read_samples(example, 20, 1000.0).speed_m_s[0] == 1.329


@pytest.mark.parametrize("there", ["subjects.csv", "swe/A.csv", "notes.txt"])
def test_a_template_overwrites_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], there: str
) -> None:
    (tmp_path / "cohort" / there).parent.mkdir(parents=True)
    (tmp_path / "cohort" / there).write_text("precious")
    before = snapshot(tmp_path)
    assert main(["template", str(tmp_path / "cohort")]) == 2
    assert "is there already, and is left as it is; name a folder that is new" in capsys.readouterr().err
    assert snapshot(tmp_path) == before


def test_a_template_where_the_system_takes_no_folder(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["template", "/proc/cohort"]) == 2
    assert "/proc/cohort: cannot be made (" in capsys.readouterr().err
