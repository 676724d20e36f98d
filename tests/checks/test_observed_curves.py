"""The noise of features put back on curves and draws: scale and shift in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from evaluation_cases import GRID, curves, draws, target
from scipy.stats import norm

from swesbi.checks.predictive import predict
from swesbi.checks.predictive_features import (
    SCALED_BY,
    SHIFTED_BY,
    at_phases,
    observed_curves,
    replicates,
    scale_peaks,
    shift_cycles,
)
from swesbi.seeds import generator

THETA = np.array([[60.0, 6.0, 30.0], [90.0, 4.0, 20.0]])
CURVES = curves(THETA)
CURVES[:, -1] = CURVES[:, 0]
STEPS = GRID.size - 1


def test_noise_of_the_maximum_scales_the_whole_curve_and_the_other_features_noise_does_nothing() -> None:
    many, noise = np.tile(CURVES[0], (4000, 1)), {SCALED_BY: 2.0, SHIFTED_BY: 0.0, "auc_kpa": 0.5}
    seen = observed_curves(many, noise, generator(3, "observed curves"))
    ratio = seen / CURVES[0]
    assert np.allclose(ratio, ratio[:, :1], rtol=1e-12)
    raised = seen.max(axis=1) - CURVES[0].max()
    assert raised.mean() == pytest.approx(0.0, abs=0.1)
    assert raised.std() == pytest.approx(2.0, rel=0.04)
    by_its_own = scale_peaks(CURVES, np.array([3.0, -2.0]))
    assert np.allclose(by_its_own.max(axis=1) - CURVES.max(axis=1), [3.0, -2.0])


@pytest.mark.parametrize("moved", [7, -7, STEPS + 7])
def test_a_shift_by_whole_steps_turns_the_cycle(moved: int) -> None:
    shifted = shift_cycles(CURVES, np.full(2, moved / STEPS))
    turned = np.roll(CURVES[:, :-1], moved, axis=1)
    assert np.allclose(shifted[:, :-1], turned, rtol=1e-9)
    assert np.allclose(shifted[:, -1], shifted[:, 0], rtol=1e-9)


def test_a_shift_between_steps_is_linear_and_each_curve_has_its_own() -> None:
    shifted = shift_cycles(CURVES, np.array([0.0, 0.25 / STEPS]))
    assert np.array_equal(shifted[0], CURVES[0])
    before = np.roll(CURVES[1, :-1], 1)
    assert np.allclose(shifted[1, :-1], 0.75 * CURVES[1, :-1] + 0.25 * before)


def test_noise_of_the_time_to_peak_shifts_by_its_standard_deviation() -> None:
    sine = 10.0 + np.sin(2.0 * np.pi * GRID)
    seen = observed_curves(np.tile(sine, (4000, 1)), {SHIFTED_BY: 0.03}, generator(0, "shift"))
    wave = np.exp(-2j * np.pi * GRID[:-1])
    shift = -np.angle(seen[:, :-1] @ wave / (sine[:-1] @ wave)) / (2.0 * np.pi)
    assert shift.std() == pytest.approx(0.03, rel=0.04)
    assert np.allclose(seen.max(axis=1), 11.0, atol=2e-3)


def test_curves_are_read_at_phases() -> None:
    phase = np.array([0.0, 0.5 / STEPS, 0.25, 0.9999])
    expected = [np.interp(phase, GRID, curve) for curve in CURVES]
    assert np.allclose(at_phases(CURVES, phase), expected)
    assert at_phases(np.empty((0, GRID.size)), phase).shape == (0, 4)


def test_without_noise_draws_are_seen_as_they_are() -> None:
    shown = replace(draws(THETA), curve_kpa=CURVES)
    made = replicates(shown, target(), {}, 0, "A", "prior")
    assert np.array_equal(made.curve_kpa, CURVES)
    assert np.array_equal(made.phase_kpa, shown.phase_kpa)


def test_phases_move_with_their_curve() -> None:
    shown = draws(np.tile(THETA[:1], (50, 1)))
    made = replicates(shown, target(), {SCALED_BY: 3.0}, 0, "A", "prior")
    factor = made.curve_kpa[:, 50] / shown.curve_kpa[:, 50]
    np.testing.assert_allclose(made.phase_kpa[:, 8] / shown.phase_kpa[:, 8], factor, rtol=5e-3)


def test_features_are_judged_with_their_noise() -> None:
    same = draws(np.tile(THETA[:1], (20_000, 1)))
    shown = replace(same, features=np.tile([50.0, 20.0, 0.4], (20_000, 1)))
    observed = replace(
        target(), features=np.array([51.5, 20.5, 0.46]), feature_noise_sd=np.array([1.0, 0.0, 0.03])
    )
    found = predict(replicates(shown, observed, {}, 1, "A", "prior"), observed, 0.9, of_new=False).features
    assert found.inside.tolist() == [True, False, False]
    assert found.predicted.high[0] == pytest.approx(50.0 + norm.ppf(0.95), abs=0.06)
    assert found.predicted.low[1] == found.predicted.high[1] == 20.0
