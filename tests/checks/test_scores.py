"""Scores, bands and the curve loss in closed form."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest
from evaluation_cases import GRID, LOSS, curves
from scipy.stats import norm

from swesbi.checks.cmaes import FAILED_LOSS, curve_loss
from swesbi.checks.scores import Band, band, cover, coverage, score
from swesbi.checks.settings import CmaesSettings, CurveLossSettings

OBSERVED = curves(np.array([[60.0, 6.0, 30.0]]))[0]


def flat_band(curve: np.ndarray) -> Band:
    return Band(curve, curve, curve)


@pytest.mark.parametrize("offset", [2.5, -2.5])
def test_constant_offset(offset: float) -> None:
    wrong = OBSERVED + offset
    scores = score(GRID, OBSERVED, Band(wrong, wrong - 2.0, wrong + 2.0))
    assert scores.rmse_kpa == pytest.approx(2.5) == scores.post_peak_rmse_kpa
    assert scores.nrmse == pytest.approx(2.5 / (OBSERVED.max() - OBSERVED.min()))
    assert scores.r2 == pytest.approx(1.0 - 2.5**2 / OBSERVED.var())
    assert scores.coverage == 0.0


def test_post_peak_starts_at_the_observed_peak() -> None:
    before = GRID[OBSERVED.argmax()] > GRID
    scores = score(GRID, OBSERVED, flat_band(OBSERVED + np.where(before, 3.0, 0.0)))
    assert scores.post_peak_rmse_kpa == 0.0
    assert scores.rmse_kpa == pytest.approx(3.0 * np.sqrt(before.mean()))
    assert scores.coverage == pytest.approx(1.0 - before.mean())


def test_gaussian_band_has_its_nominal_coverage() -> None:
    rng = np.random.default_rng(0)
    summary = band(rng.normal(5.0, 2.0, (4000, 2000)), 0.9)
    assert np.allclose(summary.low, 5.0 + 2.0 * norm.ppf(0.05), atol=0.35)
    assert np.allclose(summary.high, 5.0 + 2.0 * norm.ppf(0.95), atol=0.35)
    assert coverage(rng.normal(5.0, 2.0, 2000), summary) == pytest.approx(0.9, abs=0.025)


def test_each_reading_of_coverage_holds_what_its_interval_holds() -> None:
    observed = np.array([0.0, 0.7, 0.95, 1.5, 3.0])
    flat = np.tile(np.linspace(-1.0, 1.0, 1001)[:, None], (1, observed.size))
    found = cover(observed, 0.9 * flat, 2.0 * flat, 0.9)
    # ends of the central 90 %: 0.81 and 1.8; extremes 0.9
    assert (found.noiseless, found.observed, found.envelope) == pytest.approx((0.4, 0.8, 0.4))
    assert cover(observed, flat, flat, 0.9).envelope == pytest.approx(0.6)


def test_no_draws_give_no_scores() -> None:
    none = np.empty((0, GRID.size))
    assert np.isnan(band(none, 0.9).median).all()
    assert np.isnan(astuple(score(GRID, OBSERVED, band(none, 0.9)))).all()
    assert np.isnan(astuple(cover(OBSERVED, none, none, 0.9))).all()


def test_curves_that_cannot_be_scored_are_refused() -> None:
    for observed in (np.full(GRID.size, 4.0), np.where(GRID > 0.5, np.nan, OBSERVED)):
        with pytest.raises(ValueError, match="must be finite and vary"):
            score(GRID, observed, flat_band(OBSERVED))


def test_each_term_of_the_loss() -> None:
    only_correlation = CurveLossSettings(mae_weight=0.0, correlation_weight=1.0, peak_weight=0.0)
    mae = 0.1 * OBSERVED.mean() / np.ptp(OBSERVED)
    mirrored, constant = OBSERVED.max() + OBSERVED.min() - OBSERVED, np.full_like(OBSERVED, OBSERVED.max())
    for curve, weights, expected in (
        (OBSERVED, LOSS, 0.0),
        (1.1 * OBSERVED, LOSS, mae + 0.1),
        (mirrored, only_correlation, 2.0),
        (constant, only_correlation, 1.0),
    ):
        assert curve_loss(curve[None], OBSERVED, weights)[0] == pytest.approx(expected, abs=1e-12)


def test_failed_simulation_is_worse_than_any_curve() -> None:
    failed = np.where(GRID > 0.9, np.nan, OBSERVED)
    awful = 50.0 * (OBSERVED.max() - OBSERVED)
    losses = curve_loss(np.stack([failed, awful]), OBSERVED, LOSS)
    assert losses[0] == FAILED_LOSS > losses[1]


def test_searches_that_cannot_work_are_refused() -> None:
    plain = {"seeds": [200, 200], "population_size": 12, "generations": 80, "sigma0": 0.3}
    with pytest.raises(ValueError, match="not distinct"):
        CmaesSettings.from_plain(plain | {"loss": LOSS.to_plain()})
    with pytest.raises(ValueError, match="equally well"):
        CurveLossSettings(mae_weight=0.0, correlation_weight=0.0, peak_weight=0.0)
