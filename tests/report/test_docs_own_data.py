"""The page on one's own recordings does what it says, command by command."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from study_copy import ROOT, StudyCopy, copy_study

from swesbi.__main__ import main
from swesbi.answers.written import OUTPUTS
from swesbi.recording.layout import layout_of
from swesbi.recording.reader import read_samples

PAGE = (ROOT / "docs" / "own-data.md").read_text(encoding="utf-8")
BINARIES = Path(sys.executable).parent


def blocks(language: str) -> list[str]:
    """The page's code blocks in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def typed(command: str, study: StudyCopy) -> subprocess.CompletedProcess[str]:
    """Run a command of the page in the copy, with the copy's own package."""
    arguments = shlex.split(command.replace(".venv/bin", str(BINARIES)))
    environment = {**os.environ, "PYTHONPATH": str(study.folder / "src"), "NO_COLOR": "1"}
    done = subprocess.run(
        arguments, cwd=study.folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> tuple[StudyCopy, dict[str, str]]:
    """A copy of the project in which every command of the page has run, and what each printed."""
    study = copy_study(tmp_path_factory.mktemp("own-data") / "project")
    (study.folder / "fill.py").write_text(blocks("python")[0], encoding="utf-8")
    (study.folder / "septum_12.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
    commands = [line for block in blocks("sh") for line in block.splitlines()]
    return study, {command: typed(command, study).stdout for command in commands}


@pytest.mark.slow
def test_a_trained_network_answers_as_the_page_says(own_study: StudyCopy) -> None:
    study = own_study
    (study.folder / "fill.py").write_text(blocks("python")[0], encoding="utf-8")
    typed(".venv/bin/swesbi template data/septum_12", study)
    typed(".venv/bin/python fill.py", study)
    by_hand = re.search(r"^\S+/swesbi infer .*S-101.*$", PAGE, re.MULTILINE)
    whole = re.search(r"^\S+/swesbi infer .*--workers.*$", PAGE, re.MULTILINE)
    assert by_hand and whole
    # the page's network is that of the full study; this one is the smoke study's
    assert typed(f"{by_hand[0]} --overlay {study.config}", study).stdout.startswith("S-101: ")
    typed(f"{whole[0]} --overlay {study.config}", study)
    answers = study.folder / "answers" / "septum_12"
    table = pd.read_csv(answers / "answers.csv")
    assert table["subject"].tolist() == ["S-101", "S-102"]
    assert table["k0_kpa_median"].notna().all()
    for subject in ("S-101", "S-102"):
        assert xr.load_dataset(answers / subject / "observation.h5", engine="h5netcdf").sizes["phase"] == 12
        assert {path.name for path in (answers / subject).iterdir()} == set(OUTPUTS)


@pytest.mark.slow
def test_validate_prints_the_table_of_the_page(walked: tuple[StudyCopy, dict[str, str]]) -> None:
    shown = next(text for command, text in walked[1].items() if " validate " in command)
    assert "2 recordings can be used; origin: synthetic recordings of docs/own-data.md" in shown
    assert blocks("text")[0] in shown


@pytest.mark.slow
def test_push_trains_are_answered_without_a_study(walked: tuple[StudyCopy, dict[str, str]]) -> None:
    said = next(text for command, text in walked[1].items() if " infer " in command)
    assert said.startswith("A is answered from the prior of calibrated: the network of calibrated takes no")
    assert "the network of amortised has not been trained" in said
    assert "declared coefficient of variation, integrated out" in said
    answer = walked[0].folder / "answers" / "virtual_push_trains" / "A"
    assert {path.name for path in answer.iterdir()} == set(OUTPUTS)


@pytest.mark.slow
def test_there_is_a_sheet_for_each_subject(walked: tuple[StudyCopy, dict[str, str]]) -> None:
    for subject in ("S-101", "S-102"):
        assert (walked[0].folder / "sheets" / f"{subject}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_both_ways_give_the_same_observed_curve(walked: tuple[StudyCopy, dict[str, str]]) -> None:
    folder = walked[0].folder
    by_hand = xr.load_dataset(folder / "S-101.h5", engine="h5netcdf")
    made = folder / "results-septum_12" / "cohort"
    by_workflow = xr.load_dataset(made / "S-101" / "observation.h5", engine="h5netcdf")
    xr.testing.assert_identical(by_hand, by_workflow)
    assert by_hand.sizes["phase"] == 12
    assert xr.load_dataset(made / "S-102" / "observation.h5", engine="h5netcdf").attrs["subject"] == "S-102"


def test_the_mapping_of_the_page_reads_the_table_of_another_tool(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data" / "septum_12" / "swe").mkdir(parents=True)
    exec(compile(blocks("python")[0], "fill.py", "exec"), {})
    said = yaml.safe_load(next(block for block in blocks("") if block.startswith("columns:")))
    layout = layout_of(said, tmp_path / "recording.yaml")
    for patient in ("S-103", "S-104"):
        samples = read_samples(tmp_path / "tool.csv", 12, 1000.0, layout, patient)
        assert samples.speed_m_s.shape == (12 * 4 * 4,)
        assert 1.0 < np.nanmedian(samples.speed_m_s) < 4.0
        assert samples.trigger_delay_ms.max() > 800.0
    assert main(["template", "--like", "tool.csv"]) == 0
    proposed = yaml.safe_load(capsys.readouterr().out)
    assert proposed["columns"] == said["columns"]
    assert proposed["units"] == said["units"]
