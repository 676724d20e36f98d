from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from cohorts import recording, write_v5
from pages import blocks_of, typed
from study_copy import ROOT, StudyCopy

from swesbi.__main__ import main
from swesbi.answers.files import OUTPUTS, WITH_PRESSURES
from swesbi.config.read import overlay, parse_config, read_merged
from swesbi.context import CONTEXT_BOUNDS
from swesbi.recording.cohort.clinical import CLINICAL_BOUNDS
from swesbi.recording.cohort.recording_file import validated
from swesbi.recording.cohort.visits import VISIT_NAMES
from swesbi.recording.reader import read_samples
from swesbi.recording.tables.layout import COLUMNS, FREE_COLUMNS, TableLayout

PAGE = ROOT / "docs" / "own-data.md"
MAPPING, SETTINGS = (block.code for block in blocks_of(PAGE) if block.language == "yaml")
PHASES = 12
PATIENTS = {"S-103": 3, "S-104": 4}


def recorded(seed: int) -> pd.DataFrame:
    return recording(seed, PHASES).query("sample < 4")


def of_another_tool(path: Path) -> None:
    """Write the page's table of another tool: two patients, samples side by side, other units."""
    (names,) = (block.code.strip().split(",") for block in blocks_of(PAGE) if "Patient," in block.code)
    tables = []
    for patient, seed in PATIENTS.items():
        rows = ["phase_index", "trigger_delay_ms", "rr_ms", "repeat"]
        speeds = recorded(seed).pivot(index=rows, columns="sample", values="shear_wave_speed_m_s")
        across = speeds.mul(100).reset_index()
        across["phase_index"] += 1
        across[["trigger_delay_ms", "rr_ms"]] /= 1000
        across.insert(0, "Patient", patient)
        tables.append(across.set_axis(names, axis=1))
    pd.concat(tables).to_csv(path, index=False)


def test_the_mapping_of_the_page_reads_the_table_of_another_tool(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    of_another_tool(tmp_path / "tool.csv")
    said = yaml.safe_load(MAPPING)
    layout = validated(TableLayout, said, tmp_path / "recording.yaml")
    for patient, seed in PATIENTS.items():
        samples = read_samples(tmp_path / "tool.csv", PHASES, 1000.0, layout, patient)
        expected = recorded(seed)
        np.testing.assert_allclose(samples.speed_m_s, expected["shear_wave_speed_m_s"])
        np.testing.assert_allclose(samples.time_ms, expected["trigger_delay_ms"])
    assert main(["template", "--like", "tool.csv"]) == 0
    shown = capsys.readouterr().out
    assert yaml.safe_load(shown)["columns"] == said["columns"]
    assert "SWS 1 (cm/s), SWS 2 (cm/s), SWS 3 (cm/s), SWS 4 (cm/s)" in shown


def test_the_settings_of_the_page_are_settings() -> None:
    merged = overlay(read_merged(ROOT / "config.yaml"), yaml.safe_load(SETTINGS))
    assert parse_config(merged).recording.phases == PHASES


def test_the_page_names_every_column_and_file_with_its_range() -> None:
    text = PAGE.read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w.]+)`", text))
    assert {*CONTEXT_BOUNDS, *CLINICAL_BOUNDS, *VISIT_NAMES} <= named
    assert {*COLUMNS, *FREE_COLUMNS, *OUTPUTS, WITH_PRESSURES} <= named
    ranges = [*CONTEXT_BOUNDS.values(), *CLINICAL_BOUNDS.values()]
    missing = [f"{low:g} to {high:g}" for low, high in ranges if f"{low:g} to {high:g}" not in text]
    assert not missing


@pytest.mark.slow
def test_a_trained_network_answers_recordings_of_other_forms(own_study: StudyCopy) -> None:
    """Twelve phases, one in CSV of a spreadsheet and one in MATLAB, by the commands of the page."""
    study = own_study
    typed(".venv/bin/swesbi template data/septum_12", study)
    cohort = study.folder / "data" / "septum_12"
    with (cohort / "subjects.csv").open("a", encoding="utf-8") as table:
        table.write("S-101,F,34,1.66,65,88,33,0.78\nS-102,M,41,1.95,65,121,47,0.91\n")
    (cohort / "recording.yaml").write_text("origin: synthetic\nprotocol: { phases: 12 }\n", encoding="utf-8")
    recording(1, PHASES).to_csv(cohort / "swe" / "S-101.csv", index=False, sep=";", decimal=",")
    write_v5(cohort / "swe" / "S-102.mat", recording(2, PHASES))
    options = f"--phases {PHASES} --overlay {study.config}"
    typed(f".venv/bin/swesbi validate data/septum_12 {options}", study)
    typed(f".venv/bin/swesbi infer data/septum_12 --workers 2 {options}", study)
    answers = study.folder / "answers" / "septum_12"
    told = pd.read_csv(answers / "answers.csv")
    assert told["subject"].tolist() == ["S-101", "S-102"]
    assert told["k0_kpa_median"].notna().all()
    for subject in ("S-101", "S-102"):
        observed = xr.load_dataset(answers / subject / "observation.h5", engine="h5netcdf")
        assert observed.sizes["phase"] == PHASES
        assert {path.name for path in (answers / subject).iterdir()} == set(OUTPUTS)
