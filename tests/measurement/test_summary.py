from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf

from swesbi.measurement.settings import (
    SCALAR_NAMES,
    SUMMARY_NAMES,
    SUMMARY_UNITS,
    SummarySettings,
    summary_names,
    summary_units,
)
from swesbi.measurement.summary import summarise
from swesbi.recording.phases import analysis_grid

SETTINGS = SummarySettings(baseline_window=(0.8, 0.97), trajectory_points=30, use_trajectory=True)


def two_sided(
    grid: NDArray[np.float64],
    peak: float = 0.4,
    rise: float = 0.06,
    decay: float = 0.09,
    height: float = 50.0,
    base: float = 4.0,
) -> NDArray[np.float64]:
    """A Gaussian peak with its own width on either side: every scalar is known in closed form."""
    width = np.where(grid < peak, rise, decay)
    return base + height * np.exp(-0.5 * ((grid - peak) / width) ** 2)


def closed_form(peak: float, rise: float, decay: float, height: float, base: float) -> dict[str, float]:
    reach = {f: np.sqrt(-2.0 * np.log(f)) for f in (0.1, 0.5, 0.9)}
    after = decay * np.sqrt(np.pi / 2) * erf((1 - peak) / decay / np.sqrt(2))
    before = rise * np.sqrt(np.pi / 2) * erf(peak / rise / np.sqrt(2))
    window = np.linspace(0.8, 0.97, 10001)
    tail = np.mean(height * np.exp(-0.5 * ((window - peak) / decay) ** 2))
    return {
        "baseline_kpa": base + tail,
        "minimum_kpa": base + height * np.exp(-0.5 * (peak / rise) ** 2),
        "maximum_kpa": base + height,
        "amplitude_kpa": height - tail,
        "auc_kpa": base + height * (before + after),
        "post_peak_auc_kpa": base * (1 - peak) + height * after,
        "max_up_slope_kpa_per_cycle": height / rise * np.exp(-0.5),
        "mean_up_slope_kpa_per_cycle": 0.8 * height / (rise * (reach[0.1] - reach[0.9])),
        "time_to_peak_cycle": peak,
        "rise_time_10_90_cycle": rise * (reach[0.1] - reach[0.9]),
        "time_to_half_rise_cycle": peak - rise * reach[0.5],
        "max_down_slope_kpa_per_cycle": -height / decay * np.exp(-0.5),
        "decay_slope_kpa_per_cycle": -0.8 * height / (decay * (reach[0.1] - reach[0.9])),
        "half_relaxation_time_cycle": decay * reach[0.5],
        "relaxation_time_to_10_cycle": decay * reach[0.1],
        "full_width_half_maximum_cycle": (rise + decay) * reach[0.5],
    }


def scalar(curve: NDArray[np.float64], name: str) -> float:
    return float(summarise(curve[None], SETTINGS)[0, SCALAR_NAMES.index(name)])


def test_names_are_those_of_46_features() -> None:
    assert len(SUMMARY_NAMES) == len(SUMMARY_UNITS) == len(set(SUMMARY_NAMES)) == 46
    assert len(SCALAR_NAMES) == 16
    assert summary_names(SETTINGS) == SUMMARY_NAMES
    assert summary_units(SETTINGS) == SUMMARY_UNITS
    scalar_only = SETTINGS.model_copy(update={"use_trajectory": False})
    assert summary_names(scalar_only) == SCALAR_NAMES
    curve = two_sided(analysis_grid(100))[None]
    np.testing.assert_array_equal(summarise(curve, scalar_only), summarise(curve, SETTINGS)[:, :16])


@pytest.mark.parametrize("name", SCALAR_NAMES)
@pytest.mark.parametrize("shape", [(0.4, 0.06, 0.09, 50.0, 4.0), (0.371, 0.08, 0.1, 28.0, 4.8)])
def test_scalars_of_a_known_curve(name: str, shape: tuple[float, ...]) -> None:
    exact = closed_form(*shape)[name]
    fine = scalar(two_sided(analysis_grid(4001), *shape), name)
    study = scalar(two_sided(analysis_grid(100), *shape), name)
    np.testing.assert_allclose(fine, exact, rtol=2e-3)
    np.testing.assert_allclose(study, exact, rtol=0.015, atol=2e-3)


@pytest.mark.parametrize("peak", [0.4, 0.3712])
def test_a_decay_slope_may_run_from_the_peak_to_the_end(peak: float) -> None:
    """All else stays; of a curve that has come to rest it is the height over what is left of the cycle."""
    to_end = SETTINGS.model_copy(update={"decay_slope": "peak_to_end"})
    curve = two_sided(analysis_grid(4001), peak, height=50.0)[None]
    changed = summarise(curve, SETTINGS) != summarise(curve, to_end)
    index = SCALAR_NAMES.index("decay_slope_kpa_per_cycle")
    assert np.flatnonzero(changed[0]).tolist() == [index]
    assert summarise(curve, to_end)[0, index] == pytest.approx(-50.0 / (1.0 - peak), rel=1e-3)


def test_trajectory_is_the_curve_at_uniform_phases() -> None:
    curve = two_sided(analysis_grid(1000))
    features = summarise(curve[None], SETTINGS)[0, 16:]
    np.testing.assert_allclose(features, two_sided(np.arange(30) / 30), rtol=2e-4)


@pytest.mark.parametrize("moved", ["peak", "height", "decay", "rise", "base"])
def test_features_move_without_jumps(moved: str) -> None:
    ranges = {"peak": (0.35, 0.45), "height": (20, 60), "decay": (0.06, 0.3), "rise": (0.05, 0.12)}
    values = np.linspace(*ranges.get(moved, (1.0, 8.0)), 2001)
    grid = analysis_grid(100)
    features = summarise(np.stack([two_sided(grid, **{moved: value}) for value in values]), SETTINGS)
    jump = np.abs(np.diff(features, axis=0)).max(axis=0)
    travel = np.abs(np.diff(features, axis=0)).sum(axis=0)
    scale = np.maximum(travel, 1e-3 * np.abs(features).max(axis=0))
    worst = int(np.argmax(jump / scale))
    assert jump[worst] < 0.02 * scale[worst], SUMMARY_NAMES[worst]


EARLY = SETTINGS.model_copy(update={"baseline_window": (0.02, 0.12)})
LATE = SETTINGS.model_copy(update={"baseline_window": (0.88, 0.98)})


def triangle(floor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Zero until 0.2, up to 50 at 0.4, then straight down to ``floor`` at the end of the cycle."""
    return 50.0 * np.interp(analysis_grid(100), [0.2, 0.4], [0.0, 1.0]) - np.where(
        analysis_grid(100) > 0.4, (50.0 - floor[:, None]) * (analysis_grid(100) - 0.4) / 0.6, 0.0
    )


def test_a_level_never_crossed_gives_the_end_of_the_cycle() -> None:
    curve = triangle(np.array([20.0]))
    peak, reached = (
        summarise(curve, EARLY)[0, SCALAR_NAMES.index(name)]
        for name in ("time_to_peak_cycle", "relaxation_time_to_10_cycle")
    )
    np.testing.assert_allclose(peak + reached, 1.0)
    mirrored = summarise(curve[:, ::-1], LATE)[0]
    assert mirrored[SCALAR_NAMES.index("time_to_half_rise_cycle")] > 0.0
    names = ("time_to_peak_cycle", "rise_time_10_90_cycle")
    peak, rise = (mirrored[SCALAR_NAMES.index(name)] for name in names)
    np.testing.assert_allclose(rise, peak - 0.1 * 0.6 * 50.0 / 30.0, atol=0.01)


@pytest.mark.parametrize(
    ("name", "flip", "settings"),
    [("relaxation_time_to_10_cycle", 1, EARLY), ("rise_time_10_90_cycle", -1, LATE)],
)
def test_crossing_times_reach_the_end_of_the_cycle_continuously(
    name: str, flip: int, settings: SummarySettings
) -> None:
    curves = triangle(np.linspace(0.0, 10.0, 2001))[:, ::flip]
    times = summarise(curves, settings)[:, SCALAR_NAMES.index(name)]
    assert np.ptp(times) > 0.04
    assert np.abs(np.diff(times)).max() < 1e-3


@pytest.mark.parametrize("curve", [np.full(100, 5.0), analysis_grid(100), 1.0 - analysis_grid(100)])
def test_degenerate_curves_give_finite_features(curve: NDArray[np.float64]) -> None:
    assert np.isfinite(summarise(curve[None], SETTINGS)).all()


def test_a_curve_does_not_depend_on_its_company() -> None:
    rng = np.random.default_rng(1)
    curves = two_sided(analysis_grid(100)) * rng.uniform(0.5, 2.0, (5000, 1)) + rng.uniform(0, 1, (5000, 100))
    together = summarise(curves, SETTINGS)
    np.testing.assert_array_equal(together[3000:3004], summarise(curves[3000:3004], SETTINGS))


def test_nan_and_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        summarise(np.full((2, 100), np.nan), SETTINGS)
    with pytest.raises(ValueError, match="shape"):
        summarise(np.ones(100), SETTINGS)
    with pytest.raises(ValueError, match="window"):
        SummarySettings(baseline_window=(0.9, 0.8), trajectory_points=30, use_trajectory=True)
