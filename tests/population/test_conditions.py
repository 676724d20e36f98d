"""Conditions of recordings: missing phases that ingestion admits, noise as the protocol makes it."""

from __future__ import annotations

import numpy as np
from population_case import CONFIG, EXPERIMENT
from scipy.stats import kstest

from swesbi.population.recordings import admitted, draw_conditions
from swesbi.recording.ingest import incomplete
from swesbi.recording.phases import nominal_phases

PHASE = nominal_phases(20)


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


def test_a_phase_is_noisier_than_a_whole_one_by_its_failed_samples() -> None:
    drawn = draw_conditions(
        2000, EXPERIMENT.conditions, CONFIG.acquisition, CONFIG.recording, np.random.default_rng(2)
    )
    ratio = drawn.errors.own / drawn.level[:, None]
    assert ratio.min() == 1.0
    # of 12 samples 11 % are lost: the share of the samples in the variance, 0.25, grows by an eighth
    assert 1.005 < ratio.mean() < 1.03
