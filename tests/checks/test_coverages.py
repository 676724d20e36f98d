"""Coverage by both readings of the predictive interval, and its ceiling, in closed form."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from evaluation_cases import GRID, check, draws, target
from scipy.stats import norm

from swesbi.checks.observed_curves import SCALED_BY
from swesbi.checks.predictive import predict
from swesbi.checks.predictive_features import replicates
from swesbi.checks.scores import NO_COVERAGES, cover, envelope

LEVELS = np.linspace(-1.0, 1.0, 1001)[:, None]


def test_each_reading_holds_what_its_interval_holds() -> None:
    observed = np.array([0.0, 0.7, 0.95, 1.5, 3.0])
    flat = np.tile(LEVELS, (1, observed.size))
    found = cover(observed, 0.9 * flat, 2.0 * flat, 0.9)
    # ends of the central 90 %: 0.81 and 1.8; extremes 0.9
    assert (found.noiseless, found.observed, found.envelope) == pytest.approx((0.4, 0.8, 0.4))
    assert cover(observed, flat, flat, 0.9).envelope == pytest.approx(0.6)


def test_without_draws_nothing_is_covered_or_not() -> None:
    none = np.empty((0, 3))
    assert cover(np.zeros(3), none, none, 0.9) is NO_COVERAGES
    assert np.isnan(astuple(NO_COVERAGES)).all()


def test_no_interval_holds_more_than_the_envelope() -> None:
    shown = check("B").prior
    assert 0.0 < shown.coverages.noiseless <= shown.coverages.envelope <= 1.0
    ends = envelope(shown.draws.curve_kpa)
    assert (ends.low <= shown.curve.low).all() and (ends.high >= shown.curve.high).all()


def test_noise_widens_the_interval_and_is_told_from_the_band() -> None:
    shown = check("A").posterior
    assert shown.coverages.noiseless == shown.scores.coverage
    assert shown.phase_coverages.noiseless == shown.phase_scores.coverage
    assert np.mean(shown.observed.high - shown.observed.low) > np.mean(shown.curve.high - shown.curve.low)
    assert shown.coverages.observed > shown.coverages.noiseless


def test_an_excluded_subject_has_the_ceiling_alone() -> None:
    found = check("E", supported=False)
    assert np.isnan(astuple(found.posterior.coverages)).all() and np.isnan(found.posterior.observed.low).all()
    assert np.isfinite(astuple(found.prior.coverages)).all()


def test_without_noise_draws_are_seen_as_they_are() -> None:
    shown = draws(np.array([[60.0, 6.0, 30.0], [80.0, 5.0, 25.0]]))
    closed = replace(
        shown, curve_kpa=np.concatenate([shown.curve_kpa[:, :-1], shown.curve_kpa[:, :1]], axis=1)
    )
    made = replicates(closed, target(), {}, 0, "A", "prior")
    assert np.array_equal(made.curve_kpa, closed.curve_kpa)
    assert np.array_equal(made.phase_kpa, closed.phase_kpa)


def test_phases_move_with_their_curve() -> None:
    shown = draws(np.tile([60.0, 6.0, 30.0], (50, 1)))
    made = replicates(shown, target(), {SCALED_BY: 3.0}, 0, "A", "prior")
    factor = made.curve_kpa[:, 50] / shown.curve_kpa[:, 50]
    np.testing.assert_allclose(made.phase_kpa[:, 8] / shown.phase_kpa[:, 8], factor, rtol=5e-3)
    assert made.curve_kpa.shape == (50, GRID.size)


def test_features_are_judged_with_their_noise() -> None:
    same = draws(np.tile([60.0, 6.0, 30.0], (20_000, 1)))
    shown = replace(same, features=np.tile([50.0, 20.0, 0.4], (20_000, 1)))
    observed = replace(
        target(), features=np.array([51.5, 20.5, 0.46]), feature_noise_sd=np.array([1.0, 0.0, 0.03])
    )
    found = predict(replicates(shown, observed, {}, 1, "A", "prior"), observed, 0.9, of_new=False).features
    assert found.inside.tolist() == [True, False, False]
    assert found.predicted.high[0] == pytest.approx(50.0 + norm.ppf(0.95), abs=0.06)
    assert found.predicted.low[1] == found.predicted.high[1] == 20.0
