from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from numpy.typing import NDArray
from scipy.stats import kstest

from swesbi.base.arrays import rows_of
from swesbi.verdict.nulls import (
    NEAREST,
    SMALLEST_P,
    STRIP_MASSES,
    WITH_STRIPS,
    Grade,
    Misfits,
    fit_null,
    nearest,
    overall_p,
    p_values,
    single_level,
)
from swesbi.verdict.recording import null_tests

FloatArray = NDArray[np.float64]
RULE = speed_case.rule()
TAIL = RULE.tail_fraction
FULL = float(np.mean(1.0 / np.array(STRIP_MASSES)))  # ratio at a face where all of a posterior lies


def made(count: int, seed: int) -> Misfits:
    """Well-specified recordings: p-values the more conservative the fewer points, ratios of mean one."""
    rng = np.random.default_rng(seed)
    points = np.exp(rng.uniform(np.log(2.0), np.log(61.0), count)).astype(np.int64)
    middle = 1.0 + 8.0 / points
    ratio = np.minimum(rng.gamma(0.3, 1.0 / 0.3, (count, len(WITH_STRIPS), 2)), FULL)
    declared = np.where(rng.random(count) < 0.5, 0.3, 0.0)
    return Misfits(points, np.full(count, 0.03), declared, rng.beta(middle, middle), ratio)


def test_alarms_have_the_level_of_the_rule_whatever_the_number_of_points() -> None:
    """P-values of few points are conservative, and alone would be no test."""
    found, levels = [], (RULE.doubtful_level, RULE.contradicted_level)
    for seed in range(4):
        null, own = made(2000, seed), made(2000, 100 + seed)
        few, overall = own.points < 10, overall_p(p_values(null, own, RULE))
        found.append([(overall[part] <= level).mean() for level in levels for part in (few, ~few)])
        assert np.mean(own.residuals_p[few] <= 0.025) < 0.01
    doubtful, contradicted = np.mean(found, axis=0).reshape(2, 2)
    assert doubtful.min() > 0.7 * levels[0] and doubtful.max() < 1.2 * levels[0]
    assert contradicted.min() > 0.4 * levels[1] and contradicted.max() < 1.6 * levels[1]


def test_a_flagged_test_is_what_makes_the_verdict() -> None:
    p = np.random.default_rng(3).random((5000, 2))
    for level in (0.05, 0.01):
        flagged = (p <= single_level(level)).any(axis=1)
        assert np.array_equal(flagged, overall_p(p) <= level)
        assert flagged.mean() == pytest.approx(level, rel=0.25)


def test_null_recordings_have_the_same_kind_of_errors_and_about_as_many_points() -> None:
    null = made(3000, 3)
    for declared in (True, False):
        alike = nearest(null, 30, declared)
        assert NEAREST <= len(alike) < 1.5 * NEAREST
        assert np.all((alike.errors_log_sd > 0.0) == declared)
        others = null.points[(null.errors_log_sd > 0.0) == declared]
        assert np.ptp(np.log(alike.points)) < 0.5 * np.ptp(np.log(others))


def test_null_recordings_of_another_kind_of_errors_are_no_null() -> None:
    null = made(100, 6)
    known = rows_of(null, np.flatnonzero(null.errors_log_sd == 0.0))
    with pytest.raises(ValueError, match="has declared errors.*most_errors_log_sd above 0"):
        nearest(known, 30, declared=True)


def test_more_speeds_than_any_null_recording_has_are_said() -> None:
    null, own = made(400, 4), rows_of(made(1, 5), np.array([0]))
    far = null_tests(null, replace(own, points=np.array([1000])), RULE).beyond
    assert far.startswith("among null recordings of ") and far.endswith("speeds, as none has its 1000")
    assert null_tests(null, replace(own, points=null.points[:1]), RULE).beyond == ""


@pytest.mark.parametrize("found", ["residuals", "boundary_mass"])
def test_what_no_null_recording_shows_contradicts_the_model(found: str) -> None:
    null, own = made(1200, 4), rows_of(made(1, 5), np.array([0]))
    usual = replace(own, residuals_p=np.array([0.5]), bound_ratio=np.ones_like(own.bound_ratio))
    assert null_tests(null, usual, RULE).status == Grade.NOT_CONTRADICTED
    full = usual.bound_ratio.copy()
    full[0, 1, 0] = full[0, 7, 1] = FULL
    far = {"residuals": {"residuals_p": np.array([1e-7])}, "boundary_mass": {"bound_ratio": full}}
    judged = null_tests(null, replace(usual, **far[found]), RULE)
    assert judged.status == Grade.CONTRADICTED
    assert [test.name for test in judged.tests if test.flagged] == [found]
    if found == "boundary_mass":
        assert f"lower bound of {WITH_STRIPS[1]}" in judged.tests[1].detail


def test_the_tail_reaches_beyond_the_null_recordings() -> None:
    null = fit_null(np.random.default_rng(9).standard_exponential(1000), TAIL)
    p = null.p_value(np.array([5.0, 9.0]))
    assert np.abs(np.log(p) + np.array([5.0, 9.0])).max() < 1.2  # within a factor of three
    assert p[1] < 1.0 / 1000


def test_p_values_of_fresh_statistics_are_uniform() -> None:
    rng = np.random.default_rng(2)
    null = fit_null(np.exp(rng.standard_normal(2000)), TAIL)
    assert kstest(null.p_value(np.exp(rng.standard_normal(1000))), "uniform").pvalue > 0.01


def test_no_statistic_is_impossible() -> None:
    bounded = fit_null(np.random.default_rng(10).random(500), TAIL)
    p = bounded.p_value(np.array([1.02, 1e6]))
    assert p[0] > 1e-3
    assert p[1] == SMALLEST_P


def test_p_values_fall_as_the_statistic_grows() -> None:
    null = fit_null(np.random.default_rng(11).standard_t(3, 800), TAIL)
    p = null.p_value(np.linspace(-10.0, 50.0, 4001))
    assert (np.diff(p) <= 0.004).all()  # where the fitted tail joins the steps
    assert p[0] > 0.99


def test_a_statistic_that_never_varies_raises_no_alarm() -> None:
    null = fit_null(np.full(100, -3.0), TAIL)
    assert null.p_value(np.array([-3.0]))[0] == 1.0
    assert null.p_value(np.array([1.0]))[0] == pytest.approx(1 / 101)


def test_statistics_that_are_not_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="finite numbers"):
        fit_null(np.array([1.0, np.nan]), TAIL)
