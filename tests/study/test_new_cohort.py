"""Folders of subjects outside the study: who is refused and why, which network answers, what is kept."""

from __future__ import annotations

import argparse
import re
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import speed_case
import yaml
from openpyxl import load_workbook

from swesbi.__main__ import main
from swesbi.answers.answer import Knowledge
from swesbi.answers.files import OtherAnswerError, RecordingRequest, check_untouched
from swesbi.answers.recording import ModelledRecording, observe
from swesbi.answers.table import AnswerRow, answers_table, explanations, write_answers
from swesbi.config.read import ConfigError, at_configuration, read_merged
from swesbi.config.study import Study, context_refusal, load_study
from swesbi.parameters import REPORTED_NAMES
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.cohort.observed import UsableRecording
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import same_recording
from swesbi.recording.reader import read_samples
from swesbi.study import infer
from swesbi.study.answerer import Answerer, experiments_to_ask
from swesbi.study.infer import check_table, folder_of, subjects_of
from swesbi.study.parsers import add_options
from swesbi.study.results import ExperimentFiles
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import SHIPPED_NULLS
from swesbi.verdict.summary import AnswerSummary

ROOT = Path(__file__).parents[2]
TRIAL = ROOT / "data" / "virtual_trial"
NAMES = "subject,sex,age_years,bsa_m2,hr_bpm,lvedv_ml,lvesv_ml,ivsd_cm"
THICK, GOOD, WRONG, ABSENT, SHORT = "P01-before", "P02-before", "BAD", "GONE", "P03-before"


@pytest.fixture
def cohort(tmp_path: Path) -> Path:
    """A folder of five: one good, a thick septum, a wrong row, no file, a recording that is too short."""
    folder = tmp_path / "clinic"
    (folder / "swe").mkdir(parents=True)
    rows = pd.read_csv(TRIAL / "subjects.csv").set_index("subject")[NAMES.split(",")[1:]]
    rows.loc[THICK, ["ivsd_cm", "lvedv_ml", "lvesv_ml"]] = 1.05, 95.0, 40.0
    lines = [",".join(map(str, [name, *rows.loc[name]])) for name in (THICK, GOOD, SHORT)]
    text = "\n".join([NAMES, *lines, f"{WRONG},F,50,1.7,70,90,30,9.5", f"{ABSENT},F,50,1.7,70,90,30,0.8"])
    (folder / "subjects.csv").write_text(text + "\n", encoding="utf-8")
    (folder / "recording.yaml").write_bytes((TRIAL / "recording.yaml").read_bytes())
    for name in (THICK, GOOD, SHORT):
        table = pd.read_csv(TRIAL / "swe" / f"{name}.csv", comment="#")
        kept = table["phase_index"] < 12 if name == SHORT else table["phase_index"] >= 0
        table[kept].to_csv(folder / "swe" / f"{name}.csv", index=False)
    return folder


@pytest.fixture
def study(cohort: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    """Return the configuration where no study has been run."""
    monkeypatch.chdir(ROOT)
    raw = read_merged(ROOT / "config.yaml") | {"results": str(tmp_path / "no-study")}
    return load_study(raw, new_cohort=cohort)


def answered_into(
    _: RecordingRequest, folder: Path, *, force: bool, figures: str
) -> tuple[SimpleNamespace, None]:
    """Answer nothing, in a folder."""
    assert not force and figures == "all"
    folder.mkdir(parents=True)
    return SimpleNamespace(verdict=None, recording=SimpleNamespace(noise="")), None


@pytest.fixture
def nothing_inferred(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every network that runs is there, and answers at once."""
    answer = rows()[0].answer
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(Answerer, "_knowledge", lambda *_: Knowledge(NullRecordings.read(SHIPPED_NULLS)))
    monkeypatch.setattr(ExperimentFiles, "is_there", True)
    monkeypatch.setattr(RecordingRequest, "answer_into", answered_into)
    monkeypatch.setattr(infer, "answer_text", lambda *_: "")
    monkeypatch.setattr(infer, "answer_summary", lambda *_: answer)


def test_those_who_can_be_answered_are_and_the_others_have_their_reason(
    cohort: Path, tmp_path: Path, nothing_inferred: None
) -> None:
    def asked(*further: str, folder: Path = cohort) -> pd.DataFrame:
        out = tmp_path / "-".join([folder.name, *further])
        assert main(["infer", str(folder), "--out", str(out), *further]) == 2
        return pd.read_csv(out / "answers.csv").set_index("subject")

    table = asked()
    assert list(table.index) == [THICK, GOOD, SHORT, WRONG, ABSENT]
    assert table.loc[[THICK, GOOD], "experiment"].tolist() == ["amortised", "calibrated"]
    assert table["status"].tolist() == ["not contradicted"] * 2 + ["refused"] * 3
    assert "swe/P03-before.csv" in str(table.loc[SHORT, "reason"])
    assert "column 'ivsd_cm': '9.5'" in str(table.loc[WRONG, "reason"])
    assert "there is no file GONE.csv" in str(table.loc[ABSENT, "reason"])
    by_cohort = asked("--experiment", "calibrated")
    assert by_cohort["status"].tolist() == ["refused", "not contradicted", "refused", "refused", "refused"]
    assert "ivsd_cm = 1.05 lies outside" in str(by_cohort.loc[THICK, "reason"])
    assert asked(folder=cohort / "swe").equals(table)


def test_several_recordings_are_answered_and_leave_the_table_to_the_folder(
    cohort: Path, tmp_path: Path, nothing_inferred: None, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(cohort / "swe" / f"{name}.csv") for name in (THICK, GOOD, SHORT)]
    assert main(["infer", *files[:2], "--out", str(tmp_path / "two")]) == 0
    assert main(["infer", *files, "--out", str(tmp_path / "three")]) == 2
    assert {path.name for path in (tmp_path / "three").iterdir()} == {THICK, GOOD}
    assert "2 answered, 1 refused\nrefused: P03-before: " in capsys.readouterr().out


def test_a_file_names_its_own_subject_alone(study: Study, cohort: Path) -> None:
    swe = cohort / "swe"
    files = [swe / f"{name}.csv" for name in (THICK, GOOD)]
    assert folder_of(files) == folder_of([cohort]) == folder_of([swe]) == cohort
    assert subjects_of(study, files, None) == (THICK, GOOD)
    assert subjects_of(study, [cohort], None) == subjects_of(study, [swe, files[0]], None) == ()
    assert subjects_of(study, [cohort], GOOD) == subjects_of(study, [files[1]], GOOD) == (GOOD,)
    for paths in (files[:1], files):
        with pytest.raises(ConfigError, match=f"{GOOD}.*{THICK}.csv is the recording of {THICK}"):
            subjects_of(study, paths, GOOD)
    with pytest.raises(ConfigError, match="is nobody's recording"):
        subjects_of(study, [cohort / "subjects.csv"], None)
    with pytest.raises(ConfigError, match="are of different folders"):
        folder_of([*files, TRIAL])
    table = {"origin": "a test", "columns": {"subject": "Patient"}, "table": {"file": "all.csv"}}
    (cohort / "all.csv").touch()
    (cohort / "recording.yaml").write_text(yaml.safe_dump(table), encoding="utf-8")
    shared = load_study(read_merged(ROOT / "config.yaml"), new_cohort=cohort)
    assert subjects_of(shared, [cohort / "all.csv"], None) == ()
    assert subjects_of(shared, [cohort / "all.csv"], GOOD) == (GOOD,)
    with pytest.raises(ConfigError, match="is nobody's recording"):
        subjects_of(shared, files[:1], None)


def test_a_heart_that_the_cohort_s_network_does_not_know_is_the_population_s_or_the_prior_s(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiments = experiments_to_ask(study, None)
    assert experiments == ("calibrated", "amortised")
    answerer = Answerer(study, experiments, "")
    assert answerer._network(GOOD, free=False)[0] == "amortised"  # of the package: no study has been run
    assert Answerer(study, ("calibrated",), "")._network(GOOD, free=False)[0] == ""  # none must answer
    with pytest.raises(FileNotFoundError, match="has not been run this far"):
        Answerer(study, ("calibrated",), "", required=True)._network(GOOD, free=False)
    monkeypatch.setattr(ExperimentFiles, "is_there", True)
    assert answerer._network(GOOD, free=False) == ("calibrated", "")
    assert answerer._network(GOOD, free=True) == ("amortised", "the network of calibrated takes no pushes")
    chosen, note = answerer._network(THICK, free=False)
    assert chosen == "amortised"
    assert "the network of calibrated does not know such a heart (ivsd_cm = 1.05" in note
    assert Answerer(study, experiments, "", from_prior=True)._network(GOOD, free=False)[0] == ""
    with pytest.raises(ValueError, match="calibrated: .*\n.*ivsd_cm = 1.05 lies outside"):
        Answerer(study, ("calibrated",), "", required=True)._network(THICK, free=False)
    assert context_refusal(study, "amortised", THICK) == ""
    with pytest.raises(ConfigError, match="'paper': infers from features .*; calibrated and amortised can"):
        experiments_to_ask(study, "paper")


def test_an_answer_to_other_data_is_not_written_over(study: Study, tmp_path: Path) -> None:
    observed = observe(study, GOOD)
    assert isinstance(observed, UsableRecording)
    good = ModelledRecording(observed.observation, speed_case.model())
    check_untouched(tmp_path / "nowhere", good)
    (tmp_path / "mine").mkdir()
    check_untouched(tmp_path / "mine", good)
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    with pytest.raises(OtherAnswerError, match="holds no answer; name another folder by --out, or .*--force"):
        check_untouched(tmp_path / "mine", good)
    quality, path = study.config.recording, study.outside.folder / "swe" / f"{GOOD}.csv"
    samples = read_samples(path, quality.phases, quality.density_kg_m3)
    context = study.outside.rows[GOOD].to_context()
    one = ingest(samples, context, quality, 100)
    read_back = ClinicalMeasures(*(float("nan") for _ in range(3)))  # nothing was measured, of either
    assert same_recording(one, replace(one, clinical=read_back))
    faster = type(samples)(**{**vars(samples), "speed_m_s": samples.speed_m_s * 1.001})
    assert not same_recording(one, ingest(faster, context, quality, 100))


def rows() -> list[AnswerRow]:
    limits = np.arange(1.0, 1.0 + len(REPORTED_NAMES))[:, None] * [10.0, 9.0, 11.0]
    answer = AnswerSummary("not contradicted", "", limits, 0.9, 0.3, 0.4, "importance")
    return [AnswerRow("S-1", "calibrated", answer), AnswerRow("=S-2", "calibrated", None, "two\nlines")]


def test_the_table_has_a_row_each_no_formula_and_the_same_bytes_at_any_time(
    tmp_path: Path,
) -> None:
    table = answers_table(rows())
    write_answers(table, tmp_path)
    read = pd.read_csv(tmp_path / "answers.csv")
    assert list(read) == list(explanations())
    assert read["columns_version"].tolist() == [1, 1]
    assert read["duration_ms_median"].tolist()[0] == 10.0
    assert read["reason"].tolist()[1] == "two lines"
    assert pd.read_csv(tmp_path / "answers_columns.csv")["column"].tolist() == list(explanations())
    book = load_workbook(tmp_path / "answers.xlsx")
    assert [cell.value for cell in book["answers"][1]] == list(explanations())
    formula = book["answers"]["A3"]
    assert (formula.value, formula.data_type) == ("=S-2", "s")
    with zipfile.ZipFile(tmp_path / "answers.xlsx") as archive:
        assert {member.date_time[0] for member in archive.infolist()} == {1980}
        assert b"1980-01-01" in archive.read("docProps/core.xml")


def test_the_page_of_results_names_every_column() -> None:
    page = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    section = page.partition("### Columns of answers.csv")[2].partition("\n## ")[0]
    names = {re.sub("_(median|low|high)$", "", name) for name in explanations()}
    assert {*re.findall("`([a-z0-9_]+)`", section)} - {"refused"} == names


def test_a_table_of_another_folder_of_the_same_name_is_not_written_over(tmp_path: Path) -> None:
    check_table(tmp_path, ["S-1"])
    write_answers(answers_table(rows()), tmp_path)
    check_table(tmp_path, ["S-1", "=S-2", "S-3"])
    with pytest.raises(OtherAnswerError, match="has the answers of =S-2, who are not in this folder"):
        check_table(tmp_path, ["S-1"])


def test_paths_count_from_the_file_that_names_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    for folder in (home, elsewhere):
        folder.mkdir()
    (home / "config.yaml").write_text("cohort: data/own\nresults: results\n")
    (home / "beside.yaml").write_text("results: results-beside\n")
    (elsewhere / "mine.yaml").write_text("cohort: clinic\nnetworks: next\nnew_subjects: {phases: 12}\n")
    monkeypatch.chdir(elsewhere)
    parser = argparse.ArgumentParser()
    parser.add_argument("--cohort", type=Path)
    add_options(parser)
    given = ["--config", "../home/config.yaml", "--cohort", "typed", "--overlay", "mine.yaml"]
    options = at_configuration(parser.parse_args(given))
    assert Path.cwd() == home
    assert options.cohort == elsewhere / "typed"
    merged = read_merged(options.config, options.overlay)
    assert merged["cohort"] == str(elsewhere / "clinic")
    assert merged["networks"] == str(elsewhere / "next")
    assert merged["new_subjects"] == {"phases": 12}
    assert merged["results"] == "results"
    assert read_merged(options.config, home / "beside.yaml")["results"] == "results-beside"


def test_commands_work_from_any_folder(
    cohort: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["validate", "clinic", "--config", str(ROOT / "config.yaml")]) == 2
    assert "2 recordings can be used as they are: P01-before, P02-before" in capsys.readouterr().err
    assert Path.cwd() == tmp_path
    assert main(["validate", "clinic/swe", "--config", str(ROOT / "config.yaml")]) == 2
    assert "subjects.csv: no such file; name the folder above, " in capsys.readouterr().err
    assert main(["validate", "clinic", "--config", "nowhere.yaml"]) == 2
    assert "nowhere.yaml: there is no such file; correct the path" in capsys.readouterr().err
