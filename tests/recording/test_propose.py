"""What `template --like` proposes for a table reads it, once what it leaves open is decided."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import yaml
from cohorts import recording

from swesbi.__main__ import main
from swesbi.recording.columns import SPEED
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


def test_a_file_that_is_no_table_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "S.csv").write_text("nothing\n")
    assert main(["template", "--like", str(tmp_path / "S.csv")]) == 2
    assert "has no row with names of columns" in capsys.readouterr().err
