"""Conditions of recordings: missing phases that ingestion admits, noise as the protocol makes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from population_case import CONFIG, EXPERIMENT, FRESH
from scipy.stats import kstest

from swesbi.checks.calibration.known import FRESH_STREAM
from swesbi.measurement.likelihood import log_speed_sd
from swesbi.population.conditions import Conditions, admitted, draw_cells, draw_conditions, draw_pushes
from swesbi.population.recordings import (
    MODEL_NOISE,
    SAMPLE_BY_SAMPLE,
    STREAMS,
    Acquisition,
    acquired_recordings,
    fresh_subject,
    record_fresh,
)
from swesbi.recording.ingest import incomplete
from swesbi.recording.phases import nominal_phases
from swesbi.recording.speed import NoiseComponents
from swesbi.verdict.null_recordings import GATED_STREAM

PHASE = nominal_phases(20)
SWEEPS = {"sample_sd_fraction": 0.08, "repeat_sd_fraction": 0.04, "sweep_fraction": 0.05}


def conditions(count: int, **changes: float) -> Conditions:
    """Return conditions of recordings by the shipped protocol, changed so."""
    protocol = CONFIG.acquisition.model_copy(update=changes)
    rng = np.random.default_rng(1)
    return draw_conditions(count, EXPERIMENT.conditions, protocol, CONFIG.recording, rng)


def test_admitted_are_those_that_ingestion_does_not_call_incomplete() -> None:
    rng = np.random.default_rng(4)
    measured = rng.random((2000, 20)) >= rng.uniform(0.0, 0.3, (2000, 1))
    found = admitted(measured, PHASE, CONFIG.recording)
    expected = [not incomplete(PHASE, row, CONFIG.recording, "a recording") for row in measured]
    assert np.array_equal(found, expected)
    assert 0.2 < np.mean(found) < 0.8


@pytest.mark.parametrize("phases", [6, 7])
def test_so_few_phases_that_no_recording_is_complete_are_refused(phases: int) -> None:
    changed = {"phases": phases}
    protocol, recording = (each.model_copy(update=changed) for each in (CONFIG.acquisition, CONFIG.recording))
    with pytest.raises(ValueError, match=rf"recording\.phases = {phases}: not even all of them"):
        draw_conditions(2, EXPERIMENT.conditions, protocol, recording, np.random.default_rng(1))


def test_conditions_are_admitted_spread_over_the_noise_levels_and_often_incomplete() -> None:
    drawn = conditions(4000)
    assert admitted(drawn.measured, PHASE, CONFIG.recording).all()
    low, high = np.log(EXPERIMENT.conditions.relative_se)
    assert kstest((np.log(drawn.level) - low) / (high - low), "uniform").pvalue > 0.01
    missing = (~drawn.measured).sum(axis=1)
    assert missing.max() == 4
    assert 0.15 < (missing == 0).mean() < 0.5
    ratio = drawn.errors.total / drawn.level[:, None]
    assert ratio.min() == pytest.approx(1.0)
    # of 12 samples 11 % are lost: the share of the samples in the variance, 0.21, grows by an eighth
    assert 1.005 < ratio.mean() < 1.03


def test_sweeps_have_their_share_of_the_noise_at_every_level() -> None:
    drawn = conditions(50, **SWEEPS, failed_fraction=0.0, outlier_fraction=0.0)
    np.testing.assert_allclose(drawn.errors.total, np.broadcast_to(drawn.level[:, None], (50, 20)))
    share = (drawn.errors.shared**2).sum(axis=2) / drawn.errors.total**2
    np.testing.assert_allclose(share, 0.05**2 / (0.05**2 + 0.04**2 + 0.08**2 / 12))
    np.testing.assert_allclose(drawn.errors.shared, drawn.errors.shared[:, :1, :1] * np.ones((1, 20, 3)))


@pytest.mark.parametrize("kind", [MODEL_NOISE, SAMPLE_BY_SAMPLE])
def test_fresh_recordings_of_sweeps_share_errors(kind: str) -> None:
    protocol = CONFIG.acquisition.model_copy(update=SWEEPS)
    fresh = FRESH.model_copy(update={"acquisition": protocol})
    subject = fresh_subject(1, fresh, 7, "sweeps")
    recording = record_fresh(subject, kind, fresh, 7, "sweeps", STREAMS[kind]).recordings[0]
    assert recording.shared.shape == (len(recording.phase), 3)
    expected = subject.level * 0.05 / np.sqrt(0.05**2 + 0.04**2 + 0.08**2 / 12)
    np.testing.assert_allclose(np.sqrt((recording.shared**2).sum(axis=1)), expected, rtol=0.01)
    assert np.median(recording.errors.total) == pytest.approx(subject.level, rel=0.1)


def test_free_running_recordings_have_two_pushes_and_more_as_often_by_their_logarithm() -> None:
    free = EXPERIMENT.conditions.free_running
    drawn = draw_pushes(6000, free, np.random.default_rng(5))
    counts = np.bincount(drawn.row, minlength=6000)
    assert (counts.min(), counts.max()) == free.pushes
    assert np.mean(counts <= 10) == pytest.approx(np.log(11 / 2) / np.log(61 / 2), abs=0.02)
    assert ((drawn.phase >= 0.0) & (drawn.phase < 1.0)).all()
    known = drawn.errors_log_sd == 0.0
    assert np.mean(known) == pytest.approx(0.5, abs=0.02)
    assert (drawn.factor[known] == 1.0).all()
    standard = np.log(drawn.factor[~known]) / drawn.errors_log_sd[~known]
    assert standard.std() == pytest.approx(1.0, abs=0.05)


def test_half_of_them_lie_in_a_part_of_the_cycle() -> None:
    free = EXPERIMENT.conditions.free_running.model_copy(update={"pushes": (50, 51)})
    drawn = draw_pushes(1000, free, np.random.default_rng(6))
    gaps = [np.diff(np.sort(drawn.phase[drawn.row == row]), append=np.nan) for row in range(1000)]
    around = [max(np.nanmax(gap), 0.0) for gap in gaps]
    assert 0.2 < np.mean(np.array(around) > 0.2) < 0.5


def test_cells_hold_gated_phases_at_their_centres_and_pushes_where_they_lie() -> None:
    drawn = draw_cells(
        3000, EXPERIMENT.conditions, CONFIG.acquisition, CONFIG.recording, np.random.default_rng(7)
    )
    gated = ~drawn.offset.any(axis=1)
    assert np.mean(gated) == pytest.approx(1.0 - EXPERIMENT.conditions.free_running.share, abs=0.03)
    assert admitted(drawn.measured[gated], PHASE, CONFIG.recording).all()
    assert drawn.measured.any(axis=1).all()
    assert np.abs(drawn.offset).max() <= 0.5
    assert (drawn.errors.shared[~gated] == 0.0).all()
    told = drawn.errors.own[~gated] / drawn.relative_se[~gated]
    np.testing.assert_allclose(told, told[:, :1] * np.ones((1, 20)))
    low, high = EXPERIMENT.conditions.seen_relative_se
    assert low < drawn.relative_se[~gated & (drawn.errors_log_sd == 0.0)].min()


def test_acquired_speeds_have_the_scale_and_the_discrepancy_of_the_model_once() -> None:
    free = FRESH.model_copy(update={"model": speed_case.settings("calibrated")})
    model = fresh_subject(1, free, 7, "once").model
    quiet = Acquisition.with_noise(
        FRESH.acquisition, NoiseComponents(1e-4, 1e-4, 0.0), (), FRESH.recording, FRESH.model.measurement
    )
    made = acquired_recordings(model, quiet, 30, 7, "once")
    missed = []
    for phi, recording in zip(made.phi, made.recordings, strict=True):
        predicted = replace(model, recording=recording).predict(phi[None])
        sd = log_speed_sd(predicted, recording.relative_se, model.settings.discrepancy)
        missed.append((np.log(recording.speed_m_s) - predicted.log_speed)[0] / sd[0])
    assert np.std(np.log(model.settings.measured_by(made.phi).speed_scale)) > 0.03
    assert np.concatenate(missed).std() == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("number", [1, 2])
def test_hearts_that_are_checked_are_not_those_of_the_null(number: int) -> None:
    check, null = (fresh_subject(number, FRESH, 7, name) for name in (FRESH_STREAM, GATED_STREAM))
    assert check.model.recording.context != null.model.recording.context
    drawn = [record_fresh(null, MODEL_NOISE, FRESH, 7, name).phi for name in (FRESH_STREAM, GATED_STREAM)]
    assert (drawn[0] != drawn[1]).all()
