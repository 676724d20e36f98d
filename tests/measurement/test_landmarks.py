from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from swesbi.measurement.landmarks import find_peak, fitted_peak, outermost_crossing_after
from swesbi.measurement.settings import SCALAR_NAMES, SummarySettings
from swesbi.measurement.summary import summarise
from swesbi.recording.phases import analysis_grid, nominal_phases, to_grid

PAPER = SummarySettings(baseline_window=(0.8, 0.97), trajectory_points=30, use_trajectory=True)
ROBUST = PAPER.model_copy(update={"landmarks": "robust"})
GRID = analysis_grid(100)
PHASE = 0.05  # distance of neighbouring phases
LANDMARKS_MOVED = ("time_to_peak_cycle", "post_peak_auc_kpa", "half_relaxation_time_cycle")


def bell(phase: NDArray[np.float64]) -> NDArray[np.float64]:
    """A smooth curve whose landmarks are known: a Gaussian of height 50 about 0.4."""
    return 4.0 + 50.0 * np.exp(-0.5 * ((phase - 0.4) / 0.09) ** 2)


def plateau(phase: NDArray[np.float64]) -> NDArray[np.float64]:
    """A curve that stays within 2 % of its peak for six phases, as a long contraction does."""
    return 4.0 + 50.0 / (1.0 + ((phase - 0.4) / 0.22) ** 8)


def scalars(curves: NDArray[np.float64], settings: SummarySettings) -> dict[str, NDArray[np.float64]]:
    features = summarise(curves, settings)
    return dict(zip(SCALAR_NAMES, features.T, strict=False))


def test_both_variants_agree_on_a_smooth_curve() -> None:
    paper, robust = (scalars(bell(GRID)[None], settings) for settings in (PAPER, ROBUST))
    for name in SCALAR_NAMES:
        step = (GRID[1] - GRID[0]) if name.endswith("_cycle") and "per_cycle" not in name else 0.0
        np.testing.assert_allclose(robust[name], paper[name], rtol=0.02, atol=step, err_msg=name)


def test_the_fitted_peak_is_exact_on_a_parabola() -> None:
    tops = np.array([0.313, 0.4, 0.487])
    curves = np.maximum(30.0 - 800.0 * (GRID - tops[:, None]) ** 2, 0.0)
    peak = fitted_peak(GRID, curves, np.zeros(3))
    np.testing.assert_allclose(peak.phase, tops, atol=1e-12)
    np.testing.assert_allclose(peak.height, 30.0, rtol=1e-12)


@pytest.mark.parametrize("index", range(5, 11))
@pytest.mark.parametrize("error", [-0.06, 0.06])
def test_one_noisy_phase_moves_the_robust_peak_by_less_than_a_phase(index: int, error: float) -> None:
    phases = nominal_phases(20)
    values = plateau(phases)
    noisy = values.copy()
    noisy[index] *= 1.0 + error
    curves = to_grid(phases, np.stack([values, noisy]), 100)
    moved = np.diff(scalars(curves, ROBUST)["time_to_peak_cycle"])
    assert abs(moved[0]) < 0.6 * PHASE


def test_the_paper_s_peak_jumps_by_phases_where_the_robust_one_stays() -> None:
    phases = nominal_phases(20)
    early, late = plateau(phases), plateau(phases)
    early[6] *= 1.03
    late[9] *= 1.03
    curves = to_grid(phases, np.stack([early, late]), 100)
    paper, robust = scalars(curves, PAPER), scalars(curves, ROBUST)
    assert np.diff(paper["time_to_peak_cycle"])[0] > 2.5 * PHASE
    assert abs(np.diff(robust["time_to_peak_cycle"])[0]) < 0.5 * PHASE
    for name in LANDMARKS_MOVED:
        assert abs(np.diff(robust[name])[0]) < 0.25 * abs(np.diff(paper[name])[0]), name


@pytest.mark.parametrize("name", ["rise_time_10_90_cycle", "decay_slope_kpa_per_cycle"])
def test_a_dip_within_the_plateau_crosses_no_level(name: str) -> None:
    phases = nominal_phases(20)
    dipped = plateau(phases)
    dipped[[7, 8]] *= (0.85, 1.0) if name.startswith("rise") else (1.0, 0.85)
    dipped[8 if name.startswith("rise") else 7] *= 1.02  # the largest value lies behind the dip, or before it
    curves = to_grid(phases, np.stack([plateau(phases), dipped]), 100)
    paper, robust = (scalars(curves, settings)[name] for settings in (PAPER, ROBUST))
    assert abs(robust[1] / robust[0] - 1.0) < 0.2
    assert abs(paper[1] / paper[0] - 1.0) > 0.5


@pytest.mark.parametrize("curve", [np.full(100, 5.0), GRID, 1.0 - GRID, np.abs(GRID - 0.5)])
def test_degenerate_curves_give_finite_features(curve: NDArray[np.float64]) -> None:
    assert np.isfinite(summarise(curve[None], ROBUST)).all()


def test_where_nothing_exceeds_the_baseline_the_fitted_peak_is_the_largest_value() -> None:
    flat = np.full((1, 100), 5.0)
    fitted, single = fitted_peak(GRID, flat, np.array([5.0])), find_peak(GRID, flat)
    np.testing.assert_array_equal(fitted.phase, single.phase)
    np.testing.assert_array_equal(fitted.height, single.height)


def test_features_move_without_jumps() -> None:
    centres = np.linspace(0.35, 0.45, 2001)
    curves = 4.0 + 50.0 * np.exp(-0.5 * ((GRID - centres[:, None]) / 0.09) ** 2)
    times = scalars(curves, ROBUST)["time_to_peak_cycle"]
    np.testing.assert_allclose(np.diff(times), np.diff(centres), atol=2e-5)


def test_a_curve_that_ends_above_a_level_leaves_it_at_the_end_of_the_cycle() -> None:
    curve = (bell(GRID) + 200.0 * np.maximum(GRID - 0.9, 0.0))[None]
    left = outermost_crossing_after(GRID, curve, find_peak(GRID, curve), np.array([8.0]))
    assert left == GRID[-1]
