from __future__ import annotations

import numpy as np
import pytest
import speed_case
from scipy.special import ndtr

from swesbi.base.arrays import FloatArray
from swesbi.persons.change.joint import JoinedSpace, NormalVisit, judge_one_person
from swesbi.persons.change.stored import log_ratios, smallest_detectable, summarise_ratios
from swesbi.persons.change.visits import Coupling
from swesbi.persons.settings import ChangeRuleSettings
from swesbi.posterior.space import LogitSpace
from swesbi.prior import draw_prior

RULE = ChangeRuleSettings(threshold=0.1, probability=0.95, power=0.8, one_person_level=0.05, null_draws=1000)
SIZE = 6
SHARES = np.array([0.0, 0.0, 0.9, 0.9, 0.9, 0.9])


def test_ratios_of_normal_draws_are_as_they_should_be() -> None:
    rng = np.random.default_rng(1)
    joint, independent = 0.3 + 0.1 * rng.standard_normal((200_000, 4)), rng.standard_normal((200_000, 4))
    ratios = summarise_ratios(joint, 0.2 * independent, 0.9, RULE)
    beyond = np.log(1.1)
    np.testing.assert_allclose(ratios.median, np.exp(0.3), rtol=3e-3)
    np.testing.assert_allclose(np.log(ratios.high / ratios.low), 2 * 1.645 * 0.1, rtol=0.02)
    np.testing.assert_allclose(ratios.rise, ndtr(3.0), atol=2e-3)
    np.testing.assert_allclose(ratios.risen, ndtr((0.3 - beyond) / 0.1), atol=3e-3)
    np.testing.assert_allclose(ratios.fallen, 0.0, atol=1e-3)
    np.testing.assert_allclose(ratios.changed, ratios.risen + ratios.fallen)
    np.testing.assert_allclose(ratios.narrowing, 0.5, atol=0.02)


@pytest.mark.parametrize("sd", [0.03, 0.1, 0.3])
def test_the_smallest_detectable_change_is_found_with_the_power_of_the_rule(sd: float) -> None:
    change = np.log1p(float(smallest_detectable(np.array(sd), RULE)))
    middle = change + sd * np.random.default_rng(2).standard_normal(100_000)
    called = ndtr((middle - np.log1p(RULE.threshold)) / sd) > RULE.probability
    assert called.mean() == pytest.approx(RULE.power, abs=0.01)


@pytest.mark.parametrize("sd", [0.05, 0.3, 2.0])
def test_where_nothing_changed_hardly_anything_is_called_a_change_however_wide_the_posterior(
    sd: float,
) -> None:
    rng = np.random.default_rng(3)
    joint = sd * (rng.standard_normal((1, 400)) + rng.standard_normal((2_000, 400)))
    ratios = summarise_ratios(joint, joint, 0.9, RULE)
    called = (ratios.one_way > RULE.probability).mean()
    assert called <= 2 * (1 - RULE.probability) + 0.03
    if sd > 1.0:  # beyond the threshold on either side, which both together would call a change
        assert (ratios.changed > RULE.probability).mean() > 0.3


def test_draws_without_a_beat_are_left_out() -> None:
    first, second = np.full((3, 4), 2.0), np.full((3, 4), 4.0)
    first[1, 3] = np.nan
    np.testing.assert_allclose(log_ratios([first, second]), np.log(2.0) * np.ones((2, 4)))
    first[:] = np.nan
    with pytest.raises(ValueError, match="no draw of the posterior has a periodic beat at both visits"):
        log_ratios([first, second])


DATA = 5.0 * np.random.default_rng(3).standard_normal((5, SIZE))
"""Recordings measure some directions of the scores, with noise of their own."""


def posterior(z: FloatArray, rng: np.random.Generator) -> NormalVisit:
    covariance = np.asarray(np.linalg.inv(np.eye(SIZE) + DATA.T @ DATA))
    observed = DATA @ z + rng.standard_normal(len(DATA))
    return NormalVisit(covariance @ DATA.T @ observed, covariance, 1e9)


def p_values(number: int, one_person: bool) -> FloatArray:
    rng = np.random.default_rng(4)
    found = []
    for _ in range(number):
        first, second = rng.standard_normal((2, SIZE))
        if one_person:
            second = SHARES * first + np.sqrt(1.0 - SHARES**2) * second
        visits = [posterior(z, rng) for z in (first, second)]
        judged = judge_one_person(visits, SHARES, 0.0, 0.05, 400, rng)
        assert judged.flagged == (judged.p_value <= 0.05)
        found.append(judged.p_value)
    return np.array(found)


def test_recordings_of_one_person_are_flagged_at_the_level_and_those_of_two_far_more_often() -> None:
    flagged = (p_values(600, one_person=True) <= 0.05).mean()
    assert flagged == pytest.approx(0.05, abs=0.027)  # three standard errors
    assert (p_values(200, one_person=False) <= 0.05).mean() > 0.5


def test_where_nothing_is_shared_nothing_is_flagged() -> None:
    rng = np.random.default_rng(5)
    visits = [posterior(3.0 * sign * np.ones(SIZE), rng) for sign in (-1.0, 1.0)]
    judged = judge_one_person(visits, np.zeros(SIZE), 0.0, 0.05, 200, rng)
    assert not judged.flagged
    assert judged.distance == 0.0


def test_the_joined_space_goes_there_and_back_with_its_slope() -> None:
    prior = speed_case.settings("calibrated").prior
    shares = np.array([0.7 if name in ("passive_ratio", "speed_scale") else 0.0 for name in prior.names])
    coupling = Coupling(prior, shares, 2)
    space = JoinedSpace((LogitSpace(prior), LogitSpace(prior)), coupling)
    psi = draw_prior(coupling.joint, 5, np.random.default_rng(6))
    u, log_slope = space.place(psi)
    np.testing.assert_allclose(space.at(u), psi, rtol=1e-6)
    for one, slope in zip(psi, log_slope, strict=True):
        step = 1e-5 * one
        moved = space.place(one + np.diag(step))[0] - space.place(one - np.diag(step))[0]
        jacobian = moved / (2.0 * step[:, None])
        assert np.linalg.slogdet(jacobian)[1] == pytest.approx(slope, abs=1e-3)
