"""Conditions of recordings: missing phases that ingestion admits, noise as the protocol makes it."""

from __future__ import annotations

import numpy as np
import pytest
from population_case import CONFIG, EXPERIMENT, FRESH
from scipy.stats import kstest

from swesbi.population.recordings import (
    ACQUIRED,
    OWN,
    admitted,
    draw_conditions,
    fresh_subject,
    record_fresh,
)
from swesbi.recording.ingest import incomplete
from swesbi.recording.phases import nominal_phases

PHASE = nominal_phases(20)
SWEEPS = {"sample_sd_fraction": 0.08, "repeat_sd_fraction": 0.04, "sweep_fraction": 0.05}


def test_admitted_are_those_that_ingestion_does_not_call_incomplete() -> None:
    rng = np.random.default_rng(4)
    measured = rng.random((2000, 20)) >= rng.uniform(0.0, 0.3, (2000, 1))
    found = admitted(measured, PHASE, CONFIG.recording)
    expected = [not incomplete(PHASE, row, CONFIG.recording, "a recording") for row in measured]
    assert np.array_equal(found, expected)
    assert 0.2 < np.mean(found) < 0.8


def test_conditions_are_admitted_spread_over_the_noise_levels_and_often_incomplete() -> None:
    drawn = draw_conditions(
        4000, EXPERIMENT.conditions, CONFIG.acquisition, CONFIG.recording, np.random.default_rng(1)
    )
    assert admitted(drawn.measured, PHASE, CONFIG.recording).all()
    low, high = np.log(EXPERIMENT.conditions.relative_se)
    assert kstest((np.log(drawn.level) - low) / (high - low), "uniform").pvalue > 0.01
    missing = (~drawn.measured).sum(axis=1)
    assert missing.max() == 4
    assert (missing > 0).mean() > 0.5
    assert (missing == 0).mean() > 0.15


def test_sweeps_have_their_share_of_the_noise_at_every_level() -> None:
    protocol = CONFIG.acquisition.model_copy(update=SWEEPS | {"failed_fraction": 0.0})
    whole = protocol.model_copy(update={"outlier_fraction": 0.0})
    rng = np.random.default_rng(3)
    drawn = draw_conditions(50, EXPERIMENT.conditions, whole, CONFIG.recording, rng)
    np.testing.assert_allclose(drawn.errors.total, np.broadcast_to(drawn.level[:, None], (50, 20)))
    share = (drawn.errors.shared**2).sum(axis=2) / drawn.errors.total**2
    np.testing.assert_allclose(share, 0.05**2 / (0.05**2 + 0.04**2 + 0.08**2 / 12))
    np.testing.assert_allclose(drawn.errors.shared, drawn.errors.shared[:, :1, :1] * np.ones((1, 20, 3)))


@pytest.mark.parametrize("kind", [OWN, ACQUIRED])
def test_fresh_recordings_of_sweeps_share_errors(kind: str) -> None:
    protocol = CONFIG.acquisition.model_copy(update=SWEEPS)
    fresh = FRESH.model_copy(update={"acquisition": protocol})
    subject = fresh_subject(1, fresh, 7, "sweeps")
    recording = record_fresh(subject, kind, fresh, 7, "sweeps", kind).recordings[0]
    assert recording.shared.shape == (len(recording.phase), 3)
    expected = subject.level * 0.05 / np.sqrt(0.05**2 + 0.04**2 + 0.08**2 / 12)
    np.testing.assert_allclose(np.sqrt((recording.shared**2).sum(axis=1)), expected, rtol=0.01)
    assert np.median(recording.errors.total) == pytest.approx(subject.level, rel=0.1)


def test_a_phase_is_noisier_than_a_whole_one_by_its_failed_samples() -> None:
    drawn = draw_conditions(
        2000, EXPERIMENT.conditions, CONFIG.acquisition, CONFIG.recording, np.random.default_rng(2)
    )
    ratio = drawn.errors.total / drawn.level[:, None]
    assert ratio.min() == pytest.approx(1.0)
    # of 12 samples 11 % are lost: the share of the samples in the variance, 0.21, grows by an eighth
    assert 1.005 < ratio.mean() < 1.03
