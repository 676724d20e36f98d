"""`template --like` fills in what alone can be meant, and lists the rest; what it fills in reads a table."""

from __future__ import annotations

from pathlib import Path

import free_case
import numpy as np
import pandas as pd
import pytest
import yaml
from cohorts import recording
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from swesbi.__main__ import main
from swesbi.recording.cohort.recording_file import validated
from swesbi.recording.reader import read_samples
from swesbi.recording.tables.layout import (
    MEASURED,
    MODULUS,
    SHEAR_MODULUS,
    SPEED,
    STANDARD_ERROR,
    TIME,
    TableLayout,
)
from swesbi.recording.tables.propose import as_yaml, proposal_for, propose

GATED = ["Phase", "Delay (ms)", "RR (ms)", "Acq", "ROI"]
FREE = {
    TIME: "Push time (s)", "rr_ms": "R-R (s)", "beat": "Cycle", "repeat": "Train", SPEED: "SWS (cm/s)",
    STANDARD_ERROR: "SE (cm/s)", "fit_r2": "R2", "status": "Flag",
}  # fmt: skip


@pytest.mark.parametrize(
    ("measured", "filled"),
    [
        (["SWS (m/s)"], {SPEED: "SWS (m/s)"}),
        (["SWS (m/s)", "SWS SD (m/s)", "Depth (mm)"], {SPEED: "SWS (m/s)"}),
        (["Stiffness (m/s)"], {SPEED: "Stiffness (m/s)"}),
        (["Young's modulus (kPa)"], {MODULUS: "Young's modulus (kPa)"}),
        (["mu (Pa)"], {SHEAR_MODULUS: "mu (Pa)"}),
        ([SPEED, "Stiffness (kPa)"], {SPEED: SPEED}),
        (["SWS"], {}),  # of no unit
        (["SWV Max (m/s)", "SWV Mean (m/s)", "SWV Min (m/s)"], {}),
        (["Stiffness (kPa)", "SWS (m/s)"], {}),
        (["Stiffness (kPa)"], {}),
        (["SWS 1 (m/s)", "SWS 2 (m/s)"], {}),
    ],
)
def test_what_was_measured_is_filled_in_where_one_alone_can_be_meant(
    measured: list[str], filled: dict[str, str]
) -> None:
    proposal = propose([*GATED, *measured])
    assert {name: proposal.columns[name] for name in MEASURED if name in proposal.columns} == filled
    listed = [name for column in MEASURED for name in proposal.candidates.get(column, ())]
    meant = [name for name in measured if "SD" not in name and "Depth" not in name]
    assert filled or set(listed) == set(meant)
    assert {name: proposal.columns[name] for name in ("phase_index", "rr_ms", "repeat", "sample")} == {
        "phase_index": "Phase", "rr_ms": "RR (ms)", "repeat": "Acq", "sample": "ROI",
    }  # fmt: skip


def test_a_recording_is_free_running_where_it_has_instants_and_no_phases() -> None:
    own = propose([TIME, "rr_ms", "beat", SPEED, STANDARD_ERROR, "fit_r2", "status"])
    assert own.free and own.columns == {name: name for name in own.columns} and len(own.columns) == 7
    assert propose([*FREE.values(), "Patient"]).columns == {**FREE, "subject": "Patient"}
    assert not propose(["Time", "Phase", "SWS"]).free and not propose(["Delay", "SWS"]).free


@pytest.mark.parametrize("errors", [True, False])
def test_the_proposal_reads_a_free_running_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], errors: bool
) -> None:
    train = free_case.train(2).assign(se_m_s=0.2, repeat=0, fit_r2=0.9)
    other = train.assign(
        time_ms=train["time_ms"] / 1000, rr_ms=train["rr_ms"] / 1000, se_m_s=20.0,
        shear_wave_speed_m_s=100.0 * train[SPEED],
    ).rename(columns=FREE)  # fmt: skip
    path = tmp_path / "S.csv"
    (other if errors else other.drop(columns=FREE[STANDARD_ERROR])).to_csv(path, index=False)
    assert main(["template", "--like", str(path)]) == 0
    shown = capsys.readouterr().out
    assert ("noise: { cv_fraction: 0.1" in shown) is not errors
    assert "# Read as free-running" in shown and "first_phase" not in shown
    layout = validated(TableLayout, yaml.safe_load(shown), tmp_path / "recording.yaml")
    found, twin = free_case.pushes(path, layout), tmp_path / "twin.csv"
    train.to_csv(twin, index=False)
    known = free_case.pushes(twin)
    for name in ("time_ms", "rr_ms", "beat", "speed_m_s", "fit_r2"):
        np.testing.assert_allclose(getattr(found, name), getattr(known, name), rtol=1e-12)


def test_settings_above_a_table_are_skipped_and_what_may_be_the_speed_is_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = recording().rename(columns={SPEED: "SWV Mean (m/s)"}).assign(**{"SWV Max (m/s)": 3.5})
    (tmp_path / "S.csv").write_text("Patient ID,P01\nProbe,4V\n\n" + table.to_csv(index=False))
    assert main(["template", "--like", str(tmp_path / "S.csv")]) == 0
    shown = capsys.readouterr().out
    assert "header_row: 4" in shown
    assert "# shear_wave_speed_m_s: could be SWV Mean (m/s), SWV Max (m/s); name the one" in shown
    savemat(tmp_path / "S.mat", {"Vs": np.arange(4.0), "t": np.array([5.0, 6.0, 7.0, 8.0])})
    assert main(["template", "--like", str(tmp_path / "S.mat")]) == 0
    assert "#   Vs  0, 1, 2" in capsys.readouterr().out


CALLED = {
    "phase_index": ("Phase", "Gate", "phase no.", "Gate index"),
    "trigger_delay_ms": ("Delay", "Trigger delay", "time after R", "Trigger"),
    "rr_ms": ("RR", "RR interval", "Cycle length"),
    "repeat": ("Repeat", "Acq", "acquisition no", "Sweep"),
    "sample": ("Sample", "ROI", "Point"),
    "fit_r2": ("R2", "Fit quality", "confidence"),
    "status": ("Status", "Flag", "Valid"),
    SPEED: ("SWS", "Shear wave velocity", "c", "group speed"),
    MODULUS: ("Young's modulus", "Youngs E"),
    SHEAR_MODULUS: ("mu", "Shear modulus"),
}
IN_UNITS = {
    "trigger_delay_ms": {"ms": 1.0, "s": 1e-3},
    "rr_ms": {"ms": 1.0, "s": 1e-3, "sec": 1e-3},
    "fit_r2": {"%": 100.0},
    SPEED: {"m/s": 1.0, "cm/s": 100.0, "mm/s": 1000.0, "m s^-1": 1.0},
    MODULUS: {"kPa": 1.0, "Pa": 1000.0},
    SHEAR_MODULUS: {"kPa": 1.0, "Pa": 1000.0},
}
BESIDE = ("Comment", "Operator", "Frame rate (Hz)", "Depth (mm)")
WRITTEN = ((".csv", ",", "."), (".csv", ";", ","), (".txt", "\t", ","), (".CSV", ";", "."), (".xlsx", "", ""))


@st.composite
def exports(draw: st.DrawFn) -> tuple[pd.DataFrame, pd.DataFrame, int, tuple[str, str, str]]:
    """A recording, what another tool makes of it, rows before its names, and how it is written."""
    known = recording(draw(st.integers(0, 9)))
    measured = draw(st.sampled_from(MEASURED))
    stiffness = {SPEED: known[SPEED], MODULUS: 3.0 * known[SPEED] ** 2, SHEAR_MODULUS: known[SPEED] ** 2}
    table = known.drop(columns=SPEED).assign(**{measured: stiffness[measured]})
    table["phase_index"] += draw(st.sampled_from((0, 1)))
    names = {}
    for column in table:
        name = draw(st.sampled_from(CALLED[column]))
        if column in IN_UNITS:
            unit, factor = draw(st.sampled_from(list(IN_UNITS[column].items())))
            table[column] *= factor
            name = draw(st.sampled_from((f"{name} ({unit})", f"{name} [{unit}]")))
        names[column] = name
    beside = draw(st.lists(st.sampled_from(BESIDE), unique=True))
    table = table.rename(columns=names).assign(**dict.fromkeys(beside, 1))
    other = table[draw(st.permutations(list(table)))]
    return known, other, draw(st.integers(0, 2)), draw(st.sampled_from(WRITTEN))


def write_table(table: pd.DataFrame, before: int, path: Path, separator: str, decimal: str) -> None:
    """Write a table below so many rows that say what it is."""
    if path.suffix == ".xlsx":
        table.to_excel(path, index=False, startrow=before)
        return
    rows = table.to_csv(index=False, sep=separator, decimal=decimal)
    path.write_text("Exported\n" * before + rows, encoding="utf-8")


@settings(max_examples=40, deadline=None)
@given(exports())
def test_a_proposal_reads_any_table_that_it_was_made_from(
    tmp_path_factory: pytest.TempPathFactory,
    made: tuple[pd.DataFrame, pd.DataFrame, int, tuple[str, str, str]],
) -> None:
    """Whatever names, order, units and separators: what is read is the recording."""
    known, other, before, (suffix, separator, decimal) = made
    folder = tmp_path_factory.mktemp("proposed")
    path, twin = folder / f"S{suffix}", folder / "twin.csv"
    write_table(other, before, path, separator, decimal)
    proposal = proposal_for(path)
    assert not proposal.candidates
    assert set(proposal.first) - set(proposal.columns.values()) == set(other) & set(BESIDE)
    layout = validated(TableLayout, yaml.safe_load(as_yaml(path, proposal)), folder / "recording.yaml")
    known.to_csv(twin, index=False)
    read, expected = read_samples(path, 20, 1000.0, layout), read_samples(twin, 20, 1000.0)
    for name, right in vars(expected).items():
        if isinstance(right, np.ndarray) and name != "status":
            np.testing.assert_allclose(getattr(read, name), right, rtol=1e-12, err_msg=name)
    np.testing.assert_array_equal(read.status, expected.status)


def test_a_file_that_is_no_table_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "S.csv").write_text("nothing\n")
    assert main(["template", "--like", str(tmp_path / "S.csv")]) == 2
    assert "has no row of names with rows of as many cells below it" in capsys.readouterr().err
