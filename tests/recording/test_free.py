"""Free-running recordings: read in every format, refused with place, value and remedy, beside gated ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import free_case
import numpy as np
import pandas as pd
import pytest
import speed_case
from free_case import DECLARED, HEART, QUALITY, observed
from scipy.io import savemat

from swesbi.artefacts import Provenance
from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.cohort.recording_file import description_of
from swesbi.recording.observation import Observation, same_recording
from swesbi.recording.problems import RecordingError
from swesbi.recording.pushes import ingest_pushes
from swesbi.recording.reader import read_samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.layout import TableLayout

POINTS = speed_case.shipped().measurement.grid_points


def same(one: Observation, other: Observation) -> None:
    assert same_recording(one, other)
    np.testing.assert_array_equal(one.samples_rejected, other.samples_rejected)


def test_an_instant_is_a_fraction_of_its_own_beat(tmp_path: Path) -> None:
    rows = "time_ms,rr_ms,beat,shear_wave_speed_m_s\n970,950,1,2.0\n500,1000,0,3.0\n"
    (tmp_path / "T.csv").write_text(rows)
    seen = observed(tmp_path / "T.csv")
    np.testing.assert_allclose(seen.phase, [970 / 950 - 1, 0.5])
    np.testing.assert_array_equal(seen.cell, [0, 10])
    assert seen.beats == 2


def test_csv_mat_and_workbook_give_the_same_to_the_last_bit(tmp_path: Path) -> None:
    table = free_case.train(3)
    table.to_csv(tmp_path / "T.csv", index=False)
    table.to_excel(tmp_path / "T.xlsx", index=False)
    vectors = {name: table[name].to_numpy(dtype=float) for name in table if name != "status"}
    savemat(tmp_path / "T.mat", vectors | {"status": table["status"].to_numpy(dtype=object)})
    plain = observed(tmp_path / "T.csv")
    assert 20 < plain.measured.sum() < len(table) == len(plain.phase)
    same(plain, observed(tmp_path / "T.xlsx"))
    same(plain, observed(tmp_path / "T.mat"))


def test_a_foreign_table_is_read_by_its_mapping(tmp_path: Path) -> None:
    table = free_case.train(3)
    table.to_csv(tmp_path / "T.csv", index=False)
    other = pd.DataFrame(
        {
            "Patient": "T",
            "Time (s)": table["time_ms"].map(lambda value: f"{value / 1e3:.5f}"),
            "RR": table["rr_ms"],
            "Beat": table["beat"],
            "c (cm/s)": (100.0 * table["shear_wave_speed_m_s"]).round(1),
            "State": table["status"].replace({"ok": "good", "no_wave": "lost"}),
        }
    )
    other.to_csv(tmp_path / "tool.csv", index=False)
    layout = TableLayout.from_plain(
        {
            "columns": {
                "subject": "Patient",
                "time_ms": "Time (s)",
                "rr_ms": "RR",
                "beat": "Beat",
                "shear_wave_speed_m_s": "c (cm/s)",
                "status": "State",
            },
            "units": {"time_ms": "s", "shear_wave_speed_m_s": "cm/s"},
            "table": {"file": "tool.csv", "statuses": {"good": "ok", "lost": "no_wave"}},
        }
    )
    same(observed(tmp_path / "T.csv"), observed(tmp_path / "tool.csv", layout))


GOOD = "100,1000,0,2.0,0.2,0.9,ok\n300,1000,0,3.0,0.3,0.9,ok\n700,1000,0,1.5,0.1,0.9,ok\n"
HEADER = "time_ms,rr_ms,beat,shear_wave_speed_m_s,se_m_s,fit_r2,status\n"


@pytest.mark.parametrize(
    ("header", "rows", "words"),
    [
        (HEADER, GOOD.replace("1000,0,2.0", "1000,a,2.0"), "column 'beat': 'a' is not a number"),
        (HEADER, GOOD.replace("2.0,0.2", "2.0,-0.2"), "column 'se_m_s': '-0.2' is outside [0, 30]"),
        (HEADER, GOOD.replace("0.9,ok", "9,ok"), "column 'fit_r2': '9' is outside [-1, 1]"),
        (HEADER, GOOD.replace("ok", "no_wave"), "0 pushes are acceptable of 3 (no_wave 3)"),
        (HEADER.replace("status", "rr_ms"), GOOD, "names a column twice: rr_ms"),
        (HEADER, GOOD + "1,2\n", "row 5"),
    ],
)
def test_what_is_malformed_is_refused_with_its_place(
    tmp_path: Path, header: str, rows: str, words: str
) -> None:
    (tmp_path / "T.csv").write_text(header + rows)
    with pytest.raises(RecordingError) as refusal:
        observed(tmp_path / "T.csv")
    assert words in str(refusal.value)
    assert "T.csv" in str(refusal.value)


def test_errors_are_told_from_the_file_or_its_fits_or_a_declaration(tmp_path: Path) -> None:
    (tmp_path / "T.csv").write_text(HEADER + GOOD)
    samples = free_case.pushes(tmp_path / "T.csv")
    seen = ingest_pushes(samples, HEART, QUALITY, DECLARED)
    assert (seen.errors_from, seen.errors_log_sd) == ("se_m_s", 0.0)
    np.testing.assert_allclose(seen.relative_se, [0.1, 0.1, 0.1 / 1.5])
    bare = HEADER.replace("se_m_s", "other")
    (tmp_path / "T.csv").write_text(bare + GOOD)
    samples = free_case.pushes(tmp_path / "T.csv")
    seen = ingest_pushes(samples, HEART, QUALITY, NoiseDeclaration(fit_points=12))
    assert (seen.errors_from, seen.errors_log_sd) == ("fit_r2", 0.0)
    np.testing.assert_allclose(seen.relative_se, np.sqrt((1 / 0.9 - 1) / 10))
    seen = ingest_pushes(samples, HEART, QUALITY, DECLARED)
    assert (seen.errors_from, seen.errors_log_sd) == ("declared", 0.3)
    with pytest.raises(RecordingError, match=r"nothing says how large .* add a column se_m_s"):
        ingest_pushes(samples, HEART, QUALITY, NoiseDeclaration())


def test_the_error_by_the_fit_is_that_of_a_fitted_slope() -> None:
    """R2 and the standard error of simulated line fits agree with the formula."""
    rng = np.random.default_rng(1)
    place = np.linspace(0.0, 10.0, 12)
    slopes, told = [], []
    for _ in range(4000):
        time = 0.4 * place + 0.3 * rng.standard_normal(12)
        slope = np.polyfit(place, time, 1)[0]
        r2 = np.corrcoef(place, time)[0, 1] ** 2
        slopes.append(slope)
        told.append(slope**2 * (1.0 / r2 - 1.0) / 10.0)
    assert np.mean(told) == pytest.approx(np.var(slopes), rel=0.08)


@pytest.mark.parametrize(
    ("noise", "words"),
    [
        ("noise: { cv_fraction: 0.1 }\n", "belong together"),
        ("noise: { fit_points: 12, cv_fraction: 0.1, cv_log_sd: 0.3 }\n", "keep one"),
        ("noise: { fit_points: 2 }\n", "noise.fit_points"),
        ("noise: { cv_fraction: 5, cv_log_sd: 0.3 }\n", "noise.cv_fraction"),
    ],
)
def test_what_cannot_be_declared_is_refused(tmp_path: Path, noise: str, words: str) -> None:
    cohort = free_case.write_free_cohort(tmp_path / "c", {"T": free_case.train()}, noise)
    with pytest.raises(RecordingError) as refusal:
        description_of(cohort, "", QUALITY)
    assert words in str(refusal.value)
    assert "recording.yaml" in str(refusal.value)


def test_protocols_stand_together_in_one_cohort(tmp_path: Path) -> None:
    cohort = free_case.mixed(tmp_path / "c")
    report = examine_cohort(cohort, QUALITY, POINTS)
    assert [str(problem) for problem in report.problems] == []
    assert [len(one.observation.phase) for one in report.subjects] == [20, 24, 62]
    assert report.usable == ("S-1", "s_2x", "S-3")
    assert report.notes == ()
    said = {name: description_of(cohort, name, QUALITY) for name in report.usable}
    assert {name: one.file.protocol.repeats_are for name, one in said.items()} == {
        "S-1": "separate", "s_2x": "sweeps", "S-3": "separate"
    }  # fmt: skip
    assert {name: one.settings.phases for name, one in said.items()} == {"S-1": 20, "s_2x": 24, "S-3": 20}
    assert said["S-3"].file.layout == TableLayout()


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ("phases: 24\n", "has the key `phases`, which is not known; did you mean `protocol.phases`?"),
        ("protocol: { phases: 3 }\n", "under the key `protocol.phases`"),
        ("[\n", "cannot be read as YAML"),
    ],
)
def test_one_recordings_trouble_leaves_the_others(tmp_path: Path, own: str, words: str) -> None:
    cohort = free_case.mixed(tmp_path / "c")
    (cohort / "swe" / "s_2x.yaml").write_text(own)
    report = examine_cohort(cohort, QUALITY, POINTS)
    assert words in str(report.problems[0])
    assert report.usable == ("S-1", "S-3")


def test_where_networks_are_asked_a_free_recording_is_refused_in_words(tmp_path: Path) -> None:
    cohort = free_case.mixed(tmp_path / "c")
    with pytest.raises(RecordingError, match=r"is free-running.*experiments of the paper need gated phases"):
        read_samples(cohort / "swe" / "S-3.csv", 20, 1000.0)


def test_an_artefact_reads_back(tmp_path: Path) -> None:
    free_case.train(3).to_csv(tmp_path / "T.csv", index=False)
    seen = observed(tmp_path / "T.csv")
    seen.write(tmp_path / "o.h5", Provenance("", "T", 1))
    again = Observation.read(tmp_path / "o.h5")
    assert same_recording(seen, again)
    assert again.rejected == seen.rejected
    assert not same_recording(seen, replace(again, errors_log_sd=0.2))
