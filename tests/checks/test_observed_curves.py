"""The noise of features put back on curves: scale and shift in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from evaluation_cases import GRID, curves

from swesbi.checks.observed_curves import (
    SCALED_BY,
    SHIFTED_BY,
    at_phases,
    observed_curves,
    scale_peaks,
    shift_cycles,
)
from swesbi.seeds import generator

CURVES = curves(np.array([[60.0, 6.0, 30.0], [90.0, 4.0, 20.0]]))
CURVES[:, -1] = CURVES[:, 0]
STEPS = GRID.size - 1


def observe(maximum_kpa: float, time_to_peak_cycle: float, n: int = 1) -> np.ndarray:
    rng = generator(3, "observed curves")
    noise = {SCALED_BY: maximum_kpa, SHIFTED_BY: time_to_peak_cycle, "auc_kpa": 0.5}
    return observed_curves(np.repeat(CURVES[:1], n, axis=0), noise, rng)


def test_without_noise_curves_stay_as_they_are() -> None:
    assert np.array_equal(observe(0.0, 0.0, 5), np.repeat(CURVES[:1], 5, axis=0))
    assert np.array_equal(observed_curves(CURVES, {}, generator(3, "observed curves")), CURVES)


def test_noise_of_the_maximum_scales_the_whole_curve() -> None:
    seen = observe(2.0, 0.0, 4000)
    ratio = seen / CURVES[0]
    assert np.allclose(ratio, ratio[:, :1], rtol=1e-12)
    raised = seen.max(axis=1) - CURVES[0].max()
    assert raised.mean() == pytest.approx(0.0, abs=0.1)
    assert raised.std() == pytest.approx(2.0, rel=0.04)


def test_a_scale_about_the_baseline_leaves_the_baseline() -> None:
    baseline = CURVES.min(axis=1)
    scaled = scale_peaks(CURVES, np.array([3.0, -2.0]), baseline)
    assert np.allclose(scaled.min(axis=1), baseline)
    assert np.allclose(scaled.max(axis=1) - CURVES.max(axis=1), [3.0, -2.0])
    assert np.array_equal(scale_peaks(CURVES, np.ones(2), 1e3), CURVES)


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


def test_a_stream_gives_the_same_curves_again() -> None:
    assert np.array_equal(observe(1.0, 0.03, 3), observe(1.0, 0.03, 3))


def test_curves_are_read_at_phases() -> None:
    phase = np.array([0.0, 0.5 / STEPS, 0.25, 0.9999])
    expected = [np.interp(phase, GRID, curve) for curve in CURVES]
    assert np.allclose(at_phases(CURVES, phase), expected)
    assert at_phases(np.empty((0, GRID.size)), phase).shape == (0, 4)
