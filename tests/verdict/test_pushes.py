"""The tests of free-running recordings: their level under the model, and what speaks against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case

from swesbi.base.arrays import rows_of
from swesbi.verdict.nulls import Grade
from swesbi.verdict.pushes import NEAREST, PushChecks, held_against, nearest
from swesbi.verdict.statistics import prior_strip_mass

RULE = speed_case.rule()
PRIOR_MASS = prior_strip_mass(speed_case.settings("calibrated").prior, 0.1)


def made(count: int, seed: int) -> PushChecks:
    """Well-specified recordings: conservative p-values, strips that contain what the prior has on average."""
    rng = np.random.default_rng(seed)
    mass = np.clip(PRIOR_MASS * rng.gamma(0.3, 1.0 / 0.3, (count, *PRIOR_MASS.shape)), 0.0, 1.0)
    declared = np.where(rng.random(count) < 0.5, 0.3, 0.0)
    return PushChecks(rng.integers(2, 60, count), declared, rng.beta(3.0, 3.0, count), mass)


def test_false_alarms_have_the_level_of_the_rule_although_p_values_are_conservative() -> None:
    null, own = made(600, 1), made(300, 2)
    judged = [held_against(null, rows_of(own, np.array([k])), PRIOR_MASS, RULE) for k in range(300)]
    rate = np.mean([one.status > Grade.NOT_CONTRADICTED for one in judged])
    assert rate == pytest.approx(RULE.strained_level, abs=0.04)
    assert np.mean(own.residuals_p <= RULE.strained_level) < 0.01  # which alone are no test


def test_null_recordings_have_the_same_kind_of_errors_and_about_as_many_pushes() -> None:
    null = made(900, 3)
    for declared in (True, False):
        alike = nearest(null, 30, declared)
        assert len(alike.pushes) == NEAREST
        assert np.all((alike.errors_log_sd > 0.0) == declared)
        others = null.pushes[(null.errors_log_sd > 0.0) == declared]
        assert np.ptp(np.log(alike.pushes)) < 0.8 * np.ptp(np.log(others))


@pytest.mark.parametrize("found", ["residuals", "boundary_mass"])
def test_what_no_null_recording_shows_contradicts_the_model(found: str) -> None:
    null, own = made(600, 4), made(1, 5)
    usual = replace(own, residuals_p=np.array([0.5]), bound_mass=np.zeros_like(own.bound_mass))
    assert held_against(null, usual, PRIOR_MASS, RULE).status == Grade.NOT_CONTRADICTED
    full = usual.bound_mass.copy()
    full[0, np.unravel_index(np.argmin(PRIOR_MASS), PRIOR_MASS.shape)[0]] = 1.0
    far = {"residuals": {"residuals_p": np.array([1e-7])}, "boundary_mass": {"bound_mass": full}}
    judged = held_against(null, replace(usual, **far[found]), PRIOR_MASS, RULE)
    assert judged.status == Grade.CONTRADICTED
    assert [test.name for test in judged.tests if test.flagged] == [found]
