from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from makers import check_made_again, maker
from numpy.typing import NDArray
from recordings import CONTEXT, RECORDING
from study_copy import ROOT

from data.makers.tables import haemodynamics
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples
from swesbi.recording.settings import ACQUISITION, ACQUISITION_SEED, AcquisitionSettings
from swesbi.recording.tables.layout import FAILED_STATUSES
from swesbi.seeds import generator
from swesbi.virtual.volunteers import VOLUNTEERS, Truth, simulate_truth

SHIPPED = ROOT / "data" / "virtual_volunteers"
MAKE = maker("virtual_volunteers")
DESIGNED_PEAK_KPA = {"A": 40, "B": 55, "C": 63, "D": 60, "E": 37, "F": 53, "G": 49, "H": 54}
BY_NAME = {volunteer.context.subject: volunteer for volunteer in VOLUNTEERS}


@cache
def truth_of(name: str) -> Truth:
    return simulate_truth(BY_NAME[name])


def shipped(name: str) -> Samples:
    return read_samples(SHIPPED / "swe" / f"{name}.csv", 20, 1000.0)


def flat_curve(stiffness_kpa: float = 12.0) -> TruthCurve:
    return TruthCurve(np.arange(100) / 100, np.full(100, stiffness_kpa))


def many(settings: AcquisitionSettings, recordings: int = 40) -> list[Samples]:
    return [acquire(flat_curve(), CONTEXT, settings, generator(seed, "test")) for seed in range(recordings)]


def test_the_shipped_files_are_regenerated_byte_for_byte(tmp_path: Path) -> None:
    MAKE.write_cohort(tmp_path, ACQUISITION_SEED)
    check_made_again("virtual_volunteers", tmp_path)


@pytest.mark.parametrize("name", BY_NAME)
def test_recorded_speeds_lie_within_published_ranges(name: str) -> None:
    found = MAKE.summarise_speeds(shipped(name), truth_of(name))
    for (low, high), value in (
        (MAKE.LATE_DIASTOLIC_SPEED_M_S, found.late_diastolic_m_s),
        (MAKE.PEAK_SPEED_M_S, found.peak_m_s),
        (MAKE.CLOSURE_SPEED_M_S, found.closure_m_s),
        (MAKE.STIFFNESS_RATIO, found.stiffness_ratio),
    ):
        assert low <= value <= high


@pytest.mark.parametrize("name", BY_NAME)
def test_true_curves_and_beats_are_as_designed(name: str) -> None:
    truth, context = truth_of(name), BY_NAME[name].context
    curve, beat = truth.curve, haemodynamics(truth)
    late = (curve.cycle_phase >= 0.80) & (curve.cycle_phase <= 0.97)
    np.testing.assert_allclose(curve.stiffness_kpa[late].mean(), BY_NAME[name].late_diastolic_kpa)
    np.testing.assert_allclose(curve.stiffness_kpa.max(), DESIGNED_PEAK_KPA[name], rtol=0.07)
    np.testing.assert_allclose(
        beat["end_diastolic_volume_ml"], context.lvedv_ml, rtol=0.12 if name == "F" else 0.10
    )
    np.testing.assert_allclose(beat["end_systolic_volume_ml"], context.lvesv_ml, rtol=0.25)
    assert 0.55 < beat["ejection_fraction"] < 0.76
    assert 100 < beat["systolic_aortic_pressure_mmhg"] < (140 if name in "ABCDEF" else 145)
    assert 60 < beat["diastolic_aortic_pressure_mmhg"] < 90
    assert 190 < beat["ejection_ms"] < 310


@pytest.mark.parametrize("name", BY_NAME)
def test_shipped_recordings_pass_ingestion_near_the_truth(name: str) -> None:
    observed = ingest(shipped(name), BY_NAME[name].context, RECORDING, 100)
    missing = BY_NAME[name].acquisition.missing_phases
    assert tuple(observed.phase_index[~observed.measured]) == missing
    of_a_repeat = BY_NAME[name].acquisition.samples_per_repeat
    assert observed.rejected["ectopic_rr"] == (of_a_repeat if name == "C" else 0)
    assert 5 < observed.rejected["outlier"] < 40 * of_a_repeat / 12
    truth = truth_of(name).curve
    true_speed = np.sqrt(np.interp(observed.phase, truth.cycle_phase, truth.stiffness_kpa) / 3.0)
    log_scale = np.nanmean(np.log(observed.speed_m_s / true_speed))
    assert abs(log_scale) < 3.0 * ACQUISITION.scale_fraction
    true_speed = true_speed * np.exp(log_scale)
    z = ((observed.speed_m_s - true_speed) / observed.speed_se_m_s)[observed.measured]
    assert np.abs(z).max() < 4.5
    assert 0.5 < np.sqrt(np.mean(z**2)) < 1.6


def test_acquisition_noise_has_the_size_it_should() -> None:
    clean = SEPARATE.model_copy(update={"failed_fraction": 0.0, "outlier_fraction": 0.0})
    speed = np.stack([samples.speed_m_s.reshape(20, 3, 12) for samples in many(clean)]) / 2.0
    np.testing.assert_allclose(speed.mean(), 1.0, atol=0.002)
    np.testing.assert_allclose(speed.std(axis=-1, ddof=1).mean(), 0.06, rtol=0.05)
    repeat_variance = speed.mean(axis=-1).var(axis=-1, ddof=1).mean() - 0.06**2 / 12
    np.testing.assert_allclose(np.sqrt(repeat_variance), 0.03, rtol=0.08)
    np.testing.assert_allclose(speed.mean(axis=(-1, -2)).std(), 0.02, rtol=0.08)


QUIET = dict.fromkeys(
    ("sample_sd_fraction", "repeat_sd_fraction", "failed_fraction", "outlier_fraction", "rr_sd_fraction"), 0.0
)
SEPARATE = ACQUISITION.model_copy(update={"sweep_fraction": 0.0, "scale_fraction": 0.0})


def shared_factors(recordings: int = 300, **shared: float) -> NDArray[np.float64]:
    """Speeds over the true speed of recordings in which nothing else goes wrong; (recordings, 20, 3)."""
    settings = SEPARATE.model_copy(update=QUIET | {"samples_per_repeat": 1} | shared)
    speeds = [samples.speed_m_s.reshape(20, 3) for samples in many(settings, recordings)]
    return np.stack(speeds) / 2.0


def test_a_sweep_error_is_that_of_a_repeat_at_all_phases() -> None:
    factor = shared_factors(sweep_fraction=0.05)
    np.testing.assert_array_equal(factor, factor[:, :1] * np.ones((1, 20, 1)))
    np.testing.assert_allclose(factor[:, 0].std(axis=1, ddof=1).mean(), 0.05 * 0.886, rtol=0.08)  # of three
    np.testing.assert_allclose(factor[:, 0].std(), 0.05, rtol=0.08)


def test_a_scale_error_is_that_of_a_whole_recording() -> None:
    factor = shared_factors(scale_fraction=0.05)
    np.testing.assert_array_equal(factor, factor[:, :1, :1] * np.ones((1, 20, 3)))
    np.testing.assert_allclose(np.log(factor[:, 0, 0]).std(), 0.05, rtol=0.12)
    both = np.log(shared_factors(scale_fraction=0.05, sweep_fraction=0.03)[:, 0])
    np.testing.assert_allclose(both.mean(axis=1).std(), np.sqrt(0.05**2 + 0.03**2 / 3), rtol=0.12)


def test_shared_errors_leave_everything_else_of_a_recording_as_it_is() -> None:
    plain = many(SEPARATE, 1)[0]
    shared = many(SEPARATE.model_copy(update={"sweep_fraction": 0.05, "scale_fraction": 0.05}), 1)[0]
    np.testing.assert_array_equal(shared.status, plain.status)
    np.testing.assert_array_equal(shared.rr_ms, plain.rr_ms)
    np.testing.assert_array_equal(shared.fit_r2, plain.fit_r2)
    ratio = shared.speed_m_s / plain.speed_m_s
    for repeat in range(3):
        np.testing.assert_allclose(np.nanstd(ratio[plain.repeat == repeat]), 0.0, atol=1e-3)  # rounding
    assert np.nanstd(ratio) > 0.01


def test_failures_and_outliers_come_as_often_as_they_should() -> None:
    samples = many(ACQUISITION)
    failed = np.concatenate([one.status != "ok" for one in samples])
    speed = np.concatenate([one.speed_m_s for one in samples])
    np.testing.assert_allclose(failed.mean(), 0.08, atol=0.006)
    np.testing.assert_array_equal(np.isnan(speed), failed)
    assert {str(status) for one in samples for status in np.unique(one.status)} == {"ok", *FAILED_STATUSES}
    far = np.abs(np.log(speed[~failed] / 2.0)) > 0.42
    np.testing.assert_allclose(far.sum() / len(speed), 0.03, atol=0.004)


def test_two_neighbouring_phases_may_be_missing_however_the_beats_fall_and_three_may_not() -> None:
    for recording in many(ACQUISITION.model_copy(update={"missing_phases": (10, 11)})):
        assert (~ingest(recording, CONTEXT, RECORDING, 100).measured).sum() == 2
    for recording in many(ACQUISITION.model_copy(update={"missing_phases": (10, 11, 12)}), recordings=5):
        with pytest.raises(RecordingError, match=r"no phase was measured for 0\.(19|20|21)"):
            ingest(recording, CONTEXT, RECORDING, 100)


def test_a_push_meets_the_stiffness_of_its_own_beat() -> None:
    ramp = TruthCurve(np.arange(400) / 400, 20.0 + 10.0 * np.sin(2 * np.pi * np.arange(400) / 400))
    settings = SEPARATE.model_copy(update=QUIET | {"rr_sd_fraction": 0.05})
    samples = acquire(ramp, CONTEXT, settings, generator(1, "test"))
    expected: NDArray[np.float64] = np.sqrt((20.0 + 10.0 * np.sin(2 * np.pi * samples.beat_phase)) / 3.0)
    np.testing.assert_allclose(samples.speed_m_s, expected, atol=6e-4)
