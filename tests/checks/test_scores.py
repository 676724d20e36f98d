"""Scores, bands, features and the curve loss in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from evaluation_cases import GRID, LOSS, curves
from scipy.stats import norm

from swesbi.checks.cmaes import FAILED_LOSS, curve_loss
from swesbi.checks.scores import NO_SCORES, Band, band, coverage, reduction_percent, score
from swesbi.checks.settings import CmaesSettings, CurveLossSettings

OBSERVED = curves(np.array([[60.0, 6.0, 30.0]]))[0]


def exact_band(offset: float = 0.0, half_width: float = 0.0) -> Band:
    return Band(OBSERVED + offset, OBSERVED + offset - half_width, OBSERVED + offset + half_width)


def test_identical_curve_scores_perfectly() -> None:
    scores = score(GRID, OBSERVED, exact_band())
    assert (scores.rmse_kpa, scores.nrmse, scores.post_peak_rmse_kpa) == (0.0, 0.0, 0.0)
    assert (scores.r2, scores.coverage) == (1.0, 1.0)


@pytest.mark.parametrize("offset", [2.5, -2.5])
def test_constant_offset(offset: float) -> None:
    scores = score(GRID, OBSERVED, exact_band(offset, half_width=2.0))
    assert scores.rmse_kpa == pytest.approx(2.5) == scores.post_peak_rmse_kpa
    assert scores.nrmse == pytest.approx(2.5 / (OBSERVED.max() - OBSERVED.min()))
    assert scores.r2 == pytest.approx(1.0 - 2.5**2 / OBSERVED.var())
    assert scores.coverage == 0.0


def test_post_peak_starts_at_the_observed_peak() -> None:
    before = GRID[OBSERVED.argmax()] > GRID
    shifted = OBSERVED + np.where(before, 3.0, 0.0)
    scores = score(GRID, OBSERVED, Band(shifted, shifted, shifted))
    assert scores.post_peak_rmse_kpa == 0.0
    assert scores.rmse_kpa == pytest.approx(3.0 * np.sqrt(before.mean()))
    assert scores.coverage == pytest.approx(1.0 - before.mean())


def test_mean_predictor_has_r2_of_zero() -> None:
    mean = np.full_like(OBSERVED, OBSERVED.mean())
    assert score(GRID, OBSERVED, Band(mean, mean, mean)).r2 == pytest.approx(0.0, abs=1e-12)


def test_gaussian_band_has_its_nominal_coverage() -> None:
    rng = np.random.default_rng(0)
    draws = rng.normal(5.0, 2.0, (4000, 2000))
    summary = band(draws, 0.9)
    assert np.allclose(summary.low, 5.0 + 2.0 * norm.ppf(0.05), atol=0.35)
    assert np.allclose(summary.high, 5.0 + 2.0 * norm.ppf(0.95), atol=0.35)
    assert coverage(rng.normal(5.0, 2.0, 2000), summary) == pytest.approx(0.9, abs=0.025)


def test_no_draws_give_no_scores() -> None:
    summary = band(np.empty((0, GRID.size)), 0.9)
    assert np.isnan(summary.median).all()
    assert np.isnan(list(vars(score(GRID, OBSERVED, summary)).values())).all()
    assert score(GRID, OBSERVED, summary) is NO_SCORES


def test_curves_that_cannot_be_scored_are_refused() -> None:
    for observed in (np.full(GRID.size, 4.0), np.where(GRID > 0.5, np.nan, OBSERVED)):
        with pytest.raises(ValueError, match="must be finite and vary"):
            score(GRID, observed, exact_band())


def test_reduction() -> None:
    assert reduction_percent(12.5, 2.5) == pytest.approx(80.0)
    assert reduction_percent(2.0, 3.0) == pytest.approx(-50.0)


def test_loss_of_the_observed_curve_is_zero() -> None:
    assert curve_loss(OBSERVED[None], OBSERVED, LOSS)[0] == pytest.approx(0.0, abs=1e-12)


def test_each_term_of_the_loss() -> None:
    scaled = 1.1 * OBSERVED
    mae = 0.1 * OBSERVED.mean() / np.ptp(OBSERVED)
    assert curve_loss(scaled[None], OBSERVED, LOSS)[0] == pytest.approx(mae + 0.0 + 0.1)
    mirrored = OBSERVED.max() + OBSERVED.min() - OBSERVED
    only_correlation = CurveLossSettings(mae_weight=0.0, correlation_weight=1.0, peak_weight=0.0)
    assert curve_loss(mirrored[None], OBSERVED, only_correlation)[0] == pytest.approx(2.0)
    constant = np.full_like(OBSERVED, OBSERVED.max())
    assert curve_loss(constant[None], OBSERVED, only_correlation)[0] == pytest.approx(1.0)


def test_failed_simulation_is_worse_than_any_curve() -> None:
    failed = np.where(GRID > 0.9, np.nan, OBSERVED)
    awful = 50.0 * (OBSERVED.max() - OBSERVED)
    losses = curve_loss(np.stack([failed, awful]), OBSERVED, LOSS)
    assert losses[0] == FAILED_LOSS > losses[1]


def test_settings_refuse_nonsense() -> None:
    plain = {"seeds": [200, 200], "population_size": 12, "generations": 80, "sigma0": 0.3}
    weights = {"mae_weight": 1.0, "correlation_weight": 1.0, "peak_weight": 1.0}
    with pytest.raises(ValueError, match="not distinct"):
        CmaesSettings.from_plain(plain | {"loss": weights})
    with pytest.raises(ValueError, match="equally well"):
        CurveLossSettings(mae_weight=0.0, correlation_weight=0.0, peak_weight=0.0)
