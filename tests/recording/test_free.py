"""Free-running recordings: read in every format, with the errors of their speeds, beside gated ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import free_case
import numpy as np
import pytest
import speed_case
from free_case import DECLARED, HEART, QUALITY, observed
from scipy.io import savemat

from swesbi.artefacts import Provenance
from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.cohort.recording_file import description_of
from swesbi.recording.ingest import ingest_pushes
from swesbi.recording.noise.errors import declared_noise
from swesbi.recording.observation import Observation, same_recording
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples
from swesbi.recording.settings import NoiseDeclaration

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


GOOD = "100,1000,0,2.0,0.2,0.9,ok\n300,1000,0,3.0,0.3,0.9,ok\n700,1000,0,1.5,0.1,0.9,ok\n"
HEADER = "time_ms,rr_ms,beat,shear_wave_speed_m_s,se_m_s,fit_r2,status\n"


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
    perfect = replace(samples, fit_r2=np.array([0.9, 1.0, 0.9]))
    with pytest.raises(RecordingError, match="'1' of the push .* tells no error"):
        ingest_pushes(perfect, HEART, QUALITY, NoiseDeclaration(fit_points=12))
    seen = ingest_pushes(samples, HEART, QUALITY, DECLARED)
    assert (seen.errors_from, seen.errors_log_sd) == ("declared", 0.3)


def test_the_error_by_the_fit_is_that_of_a_fitted_slope() -> None:
    """Of simulated line fits; the speed is the slope, or its inverse, to first order with the same error."""
    rng = np.random.default_rng(1)
    place = np.linspace(0.0, 10.0, 12)
    fits = [np.polyfit(place, 0.4 * place + 0.3 * rng.standard_normal(12), 1, full=True) for _ in range(4000)]
    slope = np.array([coefficients[0] for coefficients, *_ in fits])
    residual = np.array([squares[0] for _, squares, *_ in fits])
    explained = slope**2 * 12 * place.var()
    one, every = np.ones(len(fits)), np.zeros(len(fits), dtype=np.int64)
    r2 = explained / (explained + residual)
    samples = Samples(one, 1000.0 * one, every, slope, np.full(len(fits), "ok"), fit_r2=r2)
    told = declared_noise(samples, every == 0, NoiseDeclaration(fit_points=12))
    assert told.source == "fit_r2"
    assert np.mean((told.relative_se * slope) ** 2) == pytest.approx(np.var(slope), rel=0.08)


def test_protocols_stand_together_in_one_cohort(tmp_path: Path) -> None:
    cohort = free_case.mixed(tmp_path / "c")
    report = examine_cohort(cohort, QUALITY, POINTS)
    assert [len(one.observation.phase) for one in report.subjects] == [20, 24, 62]
    assert report.usable == ("S-1", "s_2x", "S-3") and report.notes == report.problems == ()
    said = {name: description_of(cohort, name, QUALITY) for name in report.usable}
    assert {name: one.file.protocol.repeats_are for name, one in said.items()} == {
        "S-1": "separate", "s_2x": "sweeps", "S-3": "separate"
    }  # fmt: skip
    assert {name: one.settings.phases for name, one in said.items()} == {"S-1": 20, "s_2x": 24, "S-3": 20}


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
