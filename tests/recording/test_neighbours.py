"""One push or one gated phase far outside its neighbours is named, left out and counted; others stay."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import free_case
import numpy as np
import pytest
from free_case import DECLARED, HEART, QUALITY, curve_m_s
from numpy.typing import NDArray
from recordings import CONTEXT, RECORDING, clean_speed, make_samples
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.config.view import View
from swesbi.population.recordings import (
    MODEL_NOISE,
    FreshSettings,
    fresh_subject,
    record_fresh,
    record_pushes,
)
from swesbi.recording.ingest import ingest, ingest_pushes
from swesbi.recording.problems import RecordingError
from swesbi.recording.quality import phases_left_out, push_quality, rejection, speed_by_neighbours
from swesbi.recording.samples import OUTLIER, Samples

Array = NDArray[np.float64]


def far(phase: Array, speed: Array, error: float = 0.1) -> list[int]:
    told = speed_by_neighbours(phase, speed, np.full(len(phase), error), QUALITY)
    return np.flatnonzero(~np.isnan(told)).tolist()


def train(seed: int, pushes: int = 33) -> tuple[Array, Array]:
    """Pushes at any instants of the test's curve, errors of 10 %."""
    rng = np.random.default_rng(seed)
    phase = rng.random(pushes)
    return phase, curve_m_s(phase) * np.exp(0.1 * rng.standard_normal(pushes))


def pushes(phase: Array, speed: Array) -> Samples:
    count = len(phase)
    zeros = np.zeros(count, dtype=np.int64)
    rr, status = np.full(count, 1000.0), np.full(count, "ok")
    return Samples(1e3 * phase, rr, zeros, speed, status)


def test_a_spike_is_found_in_forty_recordings_and_nothing_else() -> None:
    rng = np.random.default_rng(7)
    for seed in range(40):
        phase, speed = train(seed)
        index = int(rng.choice(np.flatnonzero((phase > 0.55) & (phase < 0.95))))
        assert far(phase, speed) == []
        speed[index] *= 2.5
        assert far(phase, speed) == [index]


def test_a_steep_rise_stays() -> None:
    """A step of a factor of four between two pushes, and on its way a push anywhere between both."""
    phase = np.arange(33) / 33.0
    for part in (0.0, 0.3, 0.5, 0.7, 1.0):
        speed = np.where((phase > 0.1) & (phase < 0.4), 4.8, 1.2)
        speed[3] = 1.2 * 4.0**part
        assert far(phase, speed, 0.02) == []


def test_few_pushes_have_no_neighbours() -> None:
    for count in (2, 5, 10):
        phase = np.linspace(0.0, 0.9, count)
        assert far(phase, np.where(np.arange(count) == count // 2, 9.0, 1.2)) == []


def test_the_order_of_the_rows_does_not_matter() -> None:
    phase, speed = train(3)
    phase[5:7], speed[5:7] = phase[4], speed[4] * np.array([1.1, 0.9])  # three pushes of one instant
    speed[[8, 20]] *= np.array([6.0, 0.2])
    order = np.random.default_rng(0).permutation(len(phase))
    told = speed_by_neighbours(phase, speed, np.full(33, 0.1), QUALITY)
    assert np.flatnonzero(~np.isnan(told)).tolist() == [8, 20]
    again = speed_by_neighbours(phase[order], speed[order], np.full(33, 0.1), QUALITY)
    np.testing.assert_allclose(again, told[order], rtol=1e-9)


def test_validate_names_the_row_of_a_wild_push(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    table = free_case.train(4)
    late = (table["time_ms"] / table["rr_ms"] > 0.6) & (table["status"] == "ok")
    index = int(np.flatnonzero(late)[3])
    table.loc[index, "shear_wave_speed_m_s"] = 9.4
    cohort = free_case.write_free_cohort(tmp_path / "c", {"T": table})
    monkeypatch.chdir(ROOT)
    assert main(["validate", str(cohort)]) == 0
    shown = capsys.readouterr().out
    assert "outlier 1" in shown
    assert f"T: outlier: row {index + 2} is left out: 9.4 m/s" in shown


def test_a_push_that_is_left_out_is_counted_and_leaves_the_others_as_they_were() -> None:
    phase, speed = train(11)
    index = int(np.argmin(np.abs(phase - 0.75)))
    wild = np.where(np.arange(33) == index, 9.4, speed)
    seen = ingest_pushes(pushes(phase, wild), HEART, QUALITY, DECLARED)
    others = np.arange(33) != index
    without = ingest_pushes(pushes(phase[others], speed[others]), HEART, QUALITY, DECLARED)
    assert seen.rejected["outlier"] == 1
    np.testing.assert_array_equal(seen.speed_m_s[seen.measured], without.speed_m_s)
    np.testing.assert_array_equal(seen.relative_se, without.relative_se)


def test_a_recording_with_many_far_pushes_is_refused() -> None:
    phase, speed = train(2)
    speed[np.argsort(phase)[-14::2]] *= 3.0
    assert len(far(phase, speed)) == 7
    with pytest.raises(RecordingError, match=r"7 of 33 pushes lie far outside .* push \d+ is left out"):
        push_quality(pushes(phase, speed), QUALITY, DECLARED)


@pytest.mark.parametrize("phase", [1, 8, 15])
def test_a_gated_phase_of_which_all_samples_are_wrong_is_left_out(phase: int) -> None:
    samples = make_samples(repeat_sd=0.03, sample_sd=0.06)
    assert phases_left_out(samples, RECORDING) == ()
    wrong = samples.phase_index == phase
    spike = replace(samples, speed_m_s=np.where(wrong, 2.5, 1.0) * samples.speed_m_s)
    assert (rejection(spike, RECORDING)[wrong] == OUTLIER).all()
    observed = ingest(spike, CONTEXT, RECORDING, 100)
    assert np.flatnonzero(~observed.measured).tolist() == [phase]
    (named,) = phases_left_out(spike, RECORDING)
    assert named.startswith(f"outlier: phase_index {phase} is left out: its mean speed is ")
    assert float(named.split()[-4]) == pytest.approx(clean_speed()[phase], rel=0.4)


def test_recordings_of_the_model_itself_lose_one_point_in_five_hundred_at_most() -> None:
    study = load_study(read_merged(ROOT / "config.yaml"))
    fresh = FreshSettings.from_plain(View(study, {"experiment": "amortised"})["fresh"])
    lost, total = np.zeros(2), np.zeros(2)
    for number in range(150):
        known = fresh_subject(number, fresh, 1, "neighbours")
        asked, made = (
            known.model.recording,
            record_fresh(known, MODEL_NOISE, fresh, 1, "neighbours").recordings[0],
        )
        model, _ = record_pushes(number, (60, 60), fresh, 1, "neighbours")
        lost += [len(asked.phase) - len(made.phase), 60 - len(model.recording.phase)]
        total += [len(asked.phase), 60]
    assert (lost <= total / 500).all()
