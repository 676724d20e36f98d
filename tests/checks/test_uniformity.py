import warnings

import numpy as np
import pytest
from arviz.stats.ecdf_utils import ecdf_confidence_band

from swesbi.checks.calibration.ranks import band, points, uniformity


def test_a_uniform_sample_leaves_the_band_as_often_as_promised() -> None:
    rng = np.random.default_rng(3)
    alarms = [uniformity(rng.random(300)).p_value < 0.05 for _ in range(2000)]
    # binomial standard deviation 0.005
    assert 0.035 <= np.mean(alarms) <= 0.065


def test_the_band_is_left_exactly_where_the_p_value_is_below_the_level() -> None:
    rng = np.random.default_rng(4)
    low, high = band(250, 0.1)
    for _ in range(300):
        found = uniformity(rng.beta(1.05, 1.0, 250))
        outside = bool(np.any((found.difference < low - 1e-12) | (found.difference > high + 1e-12)))
        assert outside == (found.p_value < 0.1), found.p_value


@pytest.mark.parametrize("n", [200, 2000])
def test_the_band_agrees_with_arviz(n: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        low, high = ecdf_confidence_band(n, points(), points(), prob=0.95)
    own_low, own_high = band(n, 0.05)
    # both are steps of 1/n, at pointwise levels that a simulation and an optimiser find
    assert np.abs(own_low - (low - points())).max() <= 2.01 / n
    assert np.abs(own_high - (high - points())).max() <= 2.01 / n


def test_ranks_among_199_draws_count_as_uniform() -> None:
    rng = np.random.default_rng(5)
    levels = (rng.integers(0, 200, size=(1000, 2000)) + 0.5) / 200.0
    alarms = [uniformity(row).p_value < 0.05 for row in levels]
    assert np.mean(alarms) <= 0.07


@pytest.mark.parametrize(
    "shape", [(1.2, 1.0), (1.0, 1.2), (0.85, 0.85), (1.2, 1.2)], ids=["high", "low", "too narrow", "too wide"]
)
def test_what_is_not_uniform_is_found(shape: tuple[float, float]) -> None:
    assert uniformity(np.random.default_rng(6).beta(*shape, 2000)).p_value < 1e-3


def test_p_values_repeat_and_a_sample_with_nan_is_refused() -> None:
    sample = np.random.default_rng(7).random(64)
    assert uniformity(sample).p_value == uniformity(sample[::-1]).p_value
    with pytest.raises(ValueError, match="without NaN"):
        uniformity(np.array([0.5, np.nan]))
