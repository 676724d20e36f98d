"""The search for the maximum, and profiles of a likelihood."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import speed_case
from identifiability_case import OBSERVED, heteroscedastic, least_squares, precision, problem, tiny
from scipy.optimize import minimize
from scipy.stats import chi2, norm

from swesbi.checks.identifiability.information import in_logit
from swesbi.checks.identifiability.likelihood import NormalProblem, maximise
from swesbi.checks.identifiability.profiles import (
    Profiles,
    drop,
    interval,
    pair_profile,
    profile,
    profiles_of,
)
from swesbi.prior import from_logit

COVARIANCE = np.linalg.inv(precision())


def test_the_search_ends_at_least_squares() -> None:
    start = np.random.default_rng(0).normal(0.0, 5.0, (20, 3))
    found = maximise(problem(), start, range(3))
    assert found.converged.all()
    np.testing.assert_allclose(found.x, np.tile(least_squares(), (20, 1)), atol=0.02)


def test_the_search_agrees_with_another_optimiser_where_the_spread_depends_on_the_parameters() -> None:
    bound = np.full(3, 5.0)
    hard = NormalProblem(heteroscedastic, OBSERVED, -bound, bound, 0.01)
    found = maximise(hard, np.zeros((1, 3)), range(3))
    other = minimize(lambda x: -hard.log_likelihood(x[None])[0], found.x[0], method="Nelder-Mead", tol=1e-8)
    assert found.log_likelihood[0] == pytest.approx(-other.fun, abs=1e-3)


def test_held_coordinates_stay_and_the_box_is_kept() -> None:
    start = np.array([[3.0, 0.0, 0.0]])
    found = maximise(problem(), start, (1, 2))
    rest = np.linalg.solve(precision()[1:, 1:], precision()[1:] @ least_squares() - precision()[1:, 0] * 3.0)
    np.testing.assert_allclose(found.x[0], [3.0, *rest], atol=0.02)
    tight = maximise(problem(0.3), np.zeros((1, 3)), range(3))
    assert np.abs(tight.x).max() == 0.3 and tight.converged.all()


@pytest.mark.parametrize("held", [0, 1, 2])
def test_the_profile_of_a_linear_normal_model_is_a_parabola(held: int) -> None:
    found = profile(problem(), held, least_squares(), 15, 21, 0.999)
    maximum = float(problem().log_likelihood(least_squares()[None])[0])
    sd = np.sqrt(COVARIANCE[held, held])
    expected = ((found.axes[0] - least_squares()[held]) / sd) ** 2
    np.testing.assert_allclose(found.deviance(maximum), expected, atol=2e-3)
    reach = norm.ppf(0.95) * sd
    low, high = interval(found, least_squares(), maximum, 0.9)
    np.testing.assert_allclose([low, high], least_squares()[held] + np.array([-reach, reach]), rtol=2e-2)


def test_the_profile_of_a_pair_is_a_quadratic_form() -> None:
    single = [profile(problem(), j, least_squares(), 15, 9, 0.999) for j in (0, 1)]
    found = pair_profile(problem(), *single, points=9)
    maximum = float(problem().log_likelihood(least_squares()[None])[0])
    away = np.stack(np.meshgrid(*found.axes, indexing="ij"), axis=-1) - least_squares()[:2]
    form = np.einsum("...j,jk,...k->...", away, np.linalg.inv(COVARIANCE[:2, :2]), away)
    np.testing.assert_allclose(found.deviance(maximum), form, atol=5e-3)
    assert form.max() > chi2.ppf(0.999, 2)


def test_an_interval_that_reaches_the_box_is_open() -> None:
    at = least_squares()[0]
    tight = NormalProblem(
        problem().moments, OBSERVED, np.array([-20.0] * 3), np.array([at, 20.0, 20.0]), 0.01
    )
    maximum = float(tight.log_likelihood(least_squares()[None])[0])
    found = profile(tight, 0, least_squares(), 15, 21, 0.999)
    low, high = interval(found, least_squares(), maximum, 0.9)
    assert np.isfinite(low) and np.isnan(high)


def test_levels_are_those_of_chi_square() -> None:
    assert drop(0.9, 1) == pytest.approx(norm.ppf(0.95) ** 2)
    assert drop(0.9, 2) == pytest.approx(-2.0 * np.log(0.1))


@cache
def _of_speeds() -> Profiles:
    return profiles_of(speed_case.model(), tiny(), 1)


def test_the_noiseless_speeds_are_likeliest_near_their_own_parameters() -> None:
    """Not at them: the timing error widens with the slope, so a gentler curve is a little likelier."""
    found, model = _of_speeds(), speed_case.model()
    np.testing.assert_allclose(found.maximum_phi, speed_case.PHI, rtol=0.08)
    assert found.log_likelihood - model.log_likelihood(speed_case.PHI[None])[0] < 0.25


def test_no_profile_is_above_the_maximum_and_each_reaches_it() -> None:
    found, model = _of_speeds(), speed_case.model()
    assert found.deviance.min() >= 0.0 and found.pair_deviance.min() >= 0.0
    # another optimiser, from the maximum, finds nothing higher
    settings = in_logit(model, 0.02)
    start = np.log((found.maximum_phi - (bounds := _bounds())[0]) / (bounds[1] - found.maximum_phi))
    other = minimize(
        lambda eta: -settings.log_likelihood(eta[None])[0],
        start,
        method="Nelder-Mead",
        options={"maxfev": 200},
    )
    assert -other.fun <= found.log_likelihood + 1e-2
    # the profile at the grid points around the maximum is as near as their distance allows
    for j in range(4):
        at = np.interp(found.maximum_phi[j], found.value[j], found.deviance[j])
        assert at < 1.5


def test_a_profile_dominates_the_likelihood_at_any_parameters() -> None:
    found, model = _of_speeds(), speed_case.model()
    rng = np.random.default_rng(3)
    for row in range(0, 9, 2):
        phi = found.maximum_phi * np.exp(rng.normal(0.0, 0.05, (200, 4)))
        phi[:, 0] = found.value[0, row]
        best = 2.0 * (found.log_likelihood - model.log_likelihood(phi).max())
        assert found.deviance[0, row] <= best + 1e-3


def test_the_intervals_hold_the_maximum() -> None:
    found = _of_speeds()
    assert np.all(found.interval[:, 0] < found.maximum_phi) and np.all(
        found.maximum_phi < found.interval[:, 1]
    )
    assert found.closed.all()


def _bounds() -> np.ndarray:
    prior = speed_case.settings().prior
    ends = from_logit(np.array([[-800.0] * 4, [800.0] * 4]), prior)
    return np.asarray(ends)
