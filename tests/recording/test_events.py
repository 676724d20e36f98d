"""Natural waves are read beside pushes or alone, and refused in words where they cannot be of any heart."""

from __future__ import annotations

from pathlib import Path

import free_case
import numpy as np
import pandas as pd
import pytest
from free_case import QUALITY, observed
from scipy.io import savemat

from swesbi.__main__ import main
from swesbi.artefacts import save, to_groups
from swesbi.recording.events import in_words
from swesbi.recording.free_observation import (
    KIND,
    read_free_observation,
    same_free_recording,
)
from swesbi.recording.layout import TableLayout
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.study.stages.origin import Origin

HEADER = "event,time_ms,rr_ms,beat,shear_wave_speed_m_s\n"
MIXED = (
    "avc,,1000,0,3.6\n,700,1000,0,1.4\nmvc,40,1000,0,1.5\n"
    "push,100,1010,1,2.0\nAVC,380,1010,1,3.3\nmvc,,1010,1,\n"
)


@pytest.fixture
def mixed(tmp_path: Path) -> Path:
    """A recording of two pushes, one mitral and two aortic waves, of which no other was seen."""
    path = tmp_path / "T.csv"
    path.write_text(HEADER + MIXED)
    return path


def test_pushes_come_first_and_waves_have_cells_of_their_own(mixed: Path) -> None:
    seen = observed(mixed)
    assert seen.event.tolist() == ["push", "push", "mvc", "avc", "avc"]
    np.testing.assert_allclose(seen.phase[:2], [100 / 1010, 0.7])
    assert np.isnan(seen.phase[2:]).all()
    np.testing.assert_array_equal(seen.cell, [1, 14, 20, 21, 21])
    np.testing.assert_array_equal(seen.speed_m_s, [2.0, 1.4, 1.5, 3.6, 3.3])
    assert in_words(seen.event) == "mvc 1, avc 2"
    assert seen.rejected["empty_speed"] == 1


def test_waves_alone_need_no_times(tmp_path: Path) -> None:
    path = tmp_path / "T.csv"
    path.write_text("event;rr_ms;beat;shear_wave_speed_m_s\navc;1000;0;3,5\navc;1010;1;3,6\n")
    seen = observed(path)
    assert seen.event.tolist() == ["avc", "avc"]
    assert np.isnan(seen.time_ms).all()
    assert seen.beats == 2


def test_a_column_that_says_push_throughout_changes_nothing(tmp_path: Path) -> None:
    table = free_case.train(3)
    table.to_csv(tmp_path / "T.csv", index=False)
    plain = observed(tmp_path / "T.csv")
    table.assign(event="push").to_csv(tmp_path / "T.csv", index=False)
    assert same_free_recording(plain, observed(tmp_path / "T.csv"))


def test_mat_workbook_and_mapping_give_the_same(mixed: Path) -> None:
    plain = observed(mixed)
    table = pd.read_csv(mixed)
    table.to_excel(mixed.with_suffix(".xlsx"), index=False)
    words = table["event"].fillna("").to_numpy(dtype=object)
    vectors = {name: table[name].to_numpy(dtype=float) for name in table if name != "event"}
    savemat(mixed.with_suffix(".mat"), vectors | {"event": words})
    assert same_free_recording(plain, observed(mixed.with_suffix(".xlsx")))
    assert same_free_recording(plain, observed(mixed.with_suffix(".mat")))
    foreign = mixed.with_name("tool.csv")
    table.rename(columns={"event": "Valve"}).assign(Patient="T").to_csv(foreign, index=False)
    said = {"columns": {"event": "Valve", "subject": "Patient"}, "table": {"file": "tool.csv"}}
    assert same_free_recording(plain, observed(foreign, TableLayout.from_plain(said)))


def test_one_event_may_be_said_of_all_rows(tmp_path: Path) -> None:
    path = tmp_path / "T.csv"
    path.write_text("rr_ms,beat,shear_wave_speed_m_s\n1000,0,3.5\n1010,1,3.6\n")
    seen = observed(path, TableLayout.from_plain({"table": {"values": {"event": "avc"}}}))
    assert seen.event.tolist() == ["avc", "avc"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADER + MIXED.replace("AVC", "tvc"), "row 6, column 'event': 'tvc' is none of push, mvc, avc"),
        (HEADER + MIXED.replace(",700", ","), "row 3, column 'time_ms': '' is no time of a push"),
        (HEADER + MIXED.replace("avc,,1000,0", "avc,,1000,"), "column 'beat': '' is not a number"),
        (HEADER + MIXED.replace("avc,,1000,0", "avc,,,0"), "column 'rr_ms': '' is not a number"),
        (HEADER + MIXED.replace("mvc,40", "mvc,400"), "'400' lies where no mitral valve closes (0 to 150 ms"),
        (
            HEADER + MIXED.replace("AVC,380", "AVC,90"),
            "'90' lies where no aortic valve closes (150 to 600 ms",
        ),
        (HEADER + MIXED.replace("AVC,380,1010,1", "AVC,380,1000,0"), "'AVC' repeats the beat, event of an"),
        (
            HEADER + MIXED.replace("1010,1,2.0", "1000,0,2.0").replace("100,", "700,"),
            "repeats the beat, time_ms",
        ),
        (
            "event,rr_ms,shear_wave_speed_m_s\nmvc,1000,2\n",
            "column 'beat': has natural waves, and does not say",
        ),
        (
            "event,rr_ms,beat,shear_wave_speed_m_s\n,1000,0,2\n",
            "column 'event': '' is a push, and the table has no",
        ),
        ("event,beat,shear_wave_speed_m_s\nmvc,0,2\n", "lacks the columns rr_ms"),
        ("event,rr_ms,beat,speed\nmvc,1000,0,2\n", "has none of the columns"),
        (HEADER + "mvc,,1000,0,2\n", "1 pushes and natural waves are acceptable of 1"),
        (HEADER + "mvc,,700,0,2\navc,,700,0,3\n", "the median RR interval is 700 ms"),
        (HEADER + "mvc,,1000,0,0.3\navc,,1000,0,0.4\n", "median shear"),
        (HEADER, "holds no data row"),
    ],
)
def test_what_no_valve_does_is_refused_with_its_place(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "T.csv"
    path.write_text(text)
    with pytest.raises(RecordingError) as refusal:
        observed(path)
    assert words in str(refusal.value)
    assert "T.csv" in str(refusal.value)


def test_an_error_that_is_missing_is_named_by_its_beat(tmp_path: Path) -> None:
    path = tmp_path / "T.csv"
    path.write_text("event,rr_ms,beat,shear_wave_speed_m_s,se_m_s\navc,1000,0,3.5,0.3\navc,1010,1,3.6,\n")
    with pytest.raises(RecordingError, match=r"'se_m_s': '' of the avc wave of beat 1 \(1 of 2 pushes\)"):
        observed(path)


def test_an_event_beside_gated_phases_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "T.csv"
    names = "phase_index,trigger_delay_ms,rr_ms,repeat,sample,shear_wave_speed_m_s,fit_r2,status,event"
    path.write_text(f"{names}\n0,20,1000,0,0,2.0,0.9,ok,mvc\n")
    with pytest.raises(RecordingError, match=r"'event': stands beside phase_index.*leave phase_index"):
        read_samples(path, 20, 1000.0)


def test_an_artefact_with_waves_reads_back(mixed: Path) -> None:
    seen = observed(mixed)
    save(mixed.with_suffix(".h5"), to_groups(seen), Origin(1, "T", "0" * 64).provenance(KIND, QUALITY))
    again = read_free_observation(mixed.with_suffix(".h5"))
    assert same_free_recording(seen, again)
    np.testing.assert_array_equal(again.cell, seen.cell)


def test_validate_counts_waves_and_draws_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cohort = free_case.write_free_cohort(tmp_path / "c", {"T": free_case.train()})
    (cohort / "swe" / "T.csv").write_text(HEADER + MIXED)
    assert main(["validate", str(cohort), "--plot", str(tmp_path / "sheets")]) == 0
    assert "2, mvc 1, avc 2" in capsys.readouterr().out
    assert (tmp_path / "sheets" / "T.png").read_bytes().startswith(b"\x89PNG")
