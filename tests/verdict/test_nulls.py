"""Null distributions: p-values uniform under the null, thresholds at their level, planted alarms found."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest, norm

from swesbi.verdict.nulls import SMALLEST_P, JointNull, fit_joint_null, fit_null

FloatArray = NDArray[np.float64]
MEMBERS = ((0, 1, 2), (3,), (4, 5))
TAIL = 0.1


def statistics(count: int, seed: int) -> FloatArray:
    """Six statistics, the first three strongly correlated, in different units."""
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((count, 6))
    z[:, 1:3] = 0.9 * z[:, :1] + np.sqrt(1 - 0.81) * z[:, 1:3]
    return np.asarray(np.exp(z * np.array([1.0, 0.1, 0.5, 1.0, 2.0, 0.3])))


@pytest.fixture(scope="module")
def joint() -> JointNull:
    return fit_joint_null(statistics(2000, 1), MEMBERS, TAIL)


def test_p_values_of_single_tests_are_uniform(joint: JointNull) -> None:
    p = joint.test_p(statistics(1000, 2))
    assert min(kstest(column, "uniform").pvalue for column in p.T) > 0.01


def test_p_values_of_groups_and_of_all_tests_are_uniform(joint: JointNull) -> None:
    p = joint.test_p(statistics(1000, 3))
    assert min(kstest(column, "uniform").pvalue for column in joint.group_p(p).T) > 0.01
    assert kstest(joint.overall_p(p), "uniform").pvalue > 0.01


@pytest.mark.parametrize("level", [0.05, 0.01])
def test_false_alarms_over_all_tests_keep_the_level(joint: JointNull, level: float) -> None:
    overall = joint.overall_p(joint.test_p(statistics(20_000, 4)))
    assert (overall <= level).mean() == pytest.approx(level, rel=0.25)


def test_the_smallest_p_value_alone_would_raise_too_many_alarms(joint: JointNull) -> None:
    p = joint.test_p(statistics(5000, 5))
    assert (p.min(axis=1) <= 0.05).mean() > 0.15


@pytest.mark.parametrize("level", [0.05, 0.01])
def test_a_flagged_test_is_what_makes_the_verdict(joint: JointNull, level: float) -> None:
    p = joint.test_p(statistics(5000, 6))
    flagged = (p <= joint.thresholds(level)).any(axis=1)
    assert (flagged == (joint.overall_p(p) <= level)).mean() > 0.998


def test_groups_share_the_false_alarms_whatever_their_size(joint: JointNull) -> None:
    flagged = joint.test_p(statistics(20_000, 7)) <= joint.thresholds(0.05)
    by_group = [flagged[:, list(group)].any(axis=1).mean() for group in MEMBERS]
    assert min(by_group) > 0.011
    assert max(by_group) < 0.024


def test_one_planted_statistic_is_found_with_its_test(joint: JointNull) -> None:
    planted = statistics(200, 8)
    planted[:, 3] = np.exp(4.5)
    p = joint.test_p(planted)
    assert (joint.overall_p(p) <= 0.01).all()
    assert (p[:, 3] <= joint.thresholds(0.01)[3]).all()
    assert (p[:, 4] <= joint.thresholds(0.01)[4]).mean() < 0.03


def test_the_tail_reaches_beyond_the_null_recordings() -> None:
    null = fit_null(np.random.default_rng(9).standard_exponential(1000), TAIL)
    p = null.p_value(np.array([5.0, 9.0]))
    assert np.abs(np.log(p) + np.array([5.0, 9.0])).max() < 1.2  # within a factor of three
    assert p[1] < 1.0 / 1000


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
    assert null.p_value(np.array([null.critical(0.02)]))[0] == pytest.approx(0.02, rel=0.02)


def test_a_statistic_that_never_varies_raises_no_alarm() -> None:
    null = fit_null(np.full(100, -3.0), TAIL)
    assert null.p_value(np.array([-3.0]))[0] == 1.0
    assert null.p_value(np.array([1.0]))[0] == pytest.approx(1 / 101)


def test_statistics_that_are_not_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="finite numbers"):
        fit_null(np.array([1.0, np.nan]), TAIL)


def test_the_null_is_not_normal_by_assumption() -> None:
    null = fit_null(np.random.default_rng(12).standard_cauchy(2000), TAIL)
    assert null.p_value(np.array([5.0]))[0] > 1000 * norm.sf(5.0)
