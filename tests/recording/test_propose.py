"""What `template --like` proposes for a table reads it, once what it leaves open is decided."""

from __future__ import annotations

from pathlib import Path

import free_case
import numpy as np
import pandas as pd
import pytest
import yaml
from cohorts import recording

from swesbi.__main__ import main
from swesbi.recording.columns import SPEED, STANDARD_ERROR, TIME
from swesbi.recording.free_samples import read_free_samples
from swesbi.recording.layout import SHEAR_MODULUS, layout_of
from swesbi.recording.propose import propose
from swesbi.recording.reader import read_samples

OTHER = {
    "phase_index": "Phase",
    "trigger_delay_ms": "Delay (s)",
    "rr_ms": "RR [s]",
    "repeat": "Acq",
    "sample": "ROI",
    SPEED: "SWS (cm/s)",
    "fit_r2": "R2",
    "status": "Flag",
}


def test_names_and_units_are_recognised() -> None:
    proposal = propose([*OTHER.values(), "Patient", "Comment"])
    assert proposal.columns == {**OTHER, "subject": "Patient"}
    assert proposal.units == {"trigger_delay_ms": "s", "rr_ms": "s", SPEED: "cm/s"}
    assert (proposal.missing, proposal.unused, proposal.spreads) == ((), ("Comment",), ())


def test_a_column_a_sample_and_standard_errors_are_recognised() -> None:
    proposal = propose(["Phase", "mu ROI 1 (kPa)", "mu ROI 2 (kPa)", "mu ROI 3 (kPa)", "speed SE"])
    assert proposal.spreads == ("speed SE",)
    assert "sample" not in propose(["Phase", "SWS 1", "SWS 2", "SWS 3"]).missing
    assert propose(["Phase", "SWS 1", "SWS 2", "SWS 3"]).columns[SPEED] == "SWS *"
    assert propose(["Phase", "mu 1", "mu 2", "mu 3"]).columns[SHEAR_MODULUS] == "mu *"


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_the_proposal_reads_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    table = recording(phases=20)
    other = table.assign(
        trigger_delay_ms=table["trigger_delay_ms"] / 1000, rr_ms=table["rr_ms"] / 1000
    ).rename(columns=OTHER)
    other["SWS (cm/s)"] *= 100.0
    path = tmp_path / f"S{suffix}"
    other.to_csv(path, index=False) if suffix == ".csv" else other.to_excel(path, index=False)
    assert main(["template", "--like", str(path)]) == 0
    said = yaml.safe_load(capsys.readouterr().out)
    read = read_samples(path, 20, 1000.0, layout_of(said, tmp_path / "recording.yaml"))
    pd.testing.assert_series_equal(
        pd.Series(read.speed_m_s), table[SPEED], check_names=False, check_exact=False, rtol=1e-12
    )


FREE = {
    TIME: "Push time (s)", "rr_ms": "RR (s)", "beat": "Beat", "repeat": "Train", SPEED: "SWS (cm/s)",
    STANDARD_ERROR: "SE (cm/s)", "fit_r2": "R2", "status": "Flag",
}  # fmt: skip


def test_columns_of_a_free_running_recording_are_recognised() -> None:
    proposal = propose([*FREE.values(), "Patient"])
    assert proposal.free
    assert proposal.columns == {**FREE, "subject": "Patient"}
    assert proposal.units == {TIME: "s", "rr_ms": "s", SPEED: "cm/s", STANDARD_ERROR: "cm/s"}
    assert (proposal.missing, proposal.unused, proposal.spreads) == ((), (), ())
    own = propose([TIME, "rr_ms", "beat", SPEED, STANDARD_ERROR, "fit_r2", "status"])
    assert own.columns == {name: name for name in own.columns} and len(own.columns) == 7
    assert not own.units
    assert propose(["t", "speed", "SD"]).spreads == ("SD",)
    assert propose(["t", "speed", "SD"]).missing == ("rr_ms",)
    assert not propose(["Time", "Phase", "SWS"]).free
    assert not propose(["Delay", "SWS"]).free


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
    layout = layout_of(yaml.safe_load(shown), tmp_path / "recording.yaml")
    read, twin = read_free_samples(path, 1000.0, layout), tmp_path / "twin.csv"
    train.to_csv(twin, index=False)
    known = read_free_samples(twin, 1000.0)
    for name in ("time_ms", "rr_ms", "beat", "speed_m_s", "fit_r2"):
        np.testing.assert_allclose(getattr(read, name), getattr(known, name), rtol=1e-12)


def test_a_file_that_is_no_table_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "S.csv").write_text("nothing\n")
    assert main(["template", "--like", str(tmp_path / "S.csv")]) == 2
    assert "has no row with names of columns" in capsys.readouterr().err
