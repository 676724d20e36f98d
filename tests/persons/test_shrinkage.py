"""A subject within its population, and draws made anew, against closed forms."""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import pytest

from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import design_of, weighted_quantiles
from swesbi.persons.cohort.model import (
    CohortModel,
    DrawSet,
    PriorAlone,
    RecycledDraws,
    Shrinkage,
    combined,
    shrink,
    shrunken_prior,
)
from swesbi.prior import PriorSettings, log_density

LEVELS = np.array([0.05, 0.5, 0.95])
ETA = np.array([40.0, 6.0, 25.0, 0.2, 0.3, 0.2])
"""A population without covariates; a subject measured to (70, 6, 40) is far up in it."""
NARROW = np.r_[ETA[:3], [0.08] * 3]
MEASURED = case.Measured(np.log([[70.0, 6.0, 40.0]]), case.ERROR_SD[None])


def of_population(eta: FloatArray) -> PriorSettings:
    """Return the prior of theta that a population is."""
    laws = zip(THETA_NAMES, case.THETA_PRIOR.parameters, eta[:3], eta[3:], strict=True)
    return case.THETA_PRIOR.model_copy(
        update={
            name: own.model_copy(update={"centre": float(centre), "log_sd": float(spread)})
            for name, own, centre, spread in laws
        }
    )


def model_of(draws: RecycledDraws, outlier: float = 0.0) -> CohortModel:
    design = design_of(case.blank(case.contexts(1, np.random.default_rng(1))))
    prior = PriorAlone(case.hyperprior(design))
    return CohortModel(prior, (draws,), design.matrix, np.array([outlier]), case.THETA_PRIOR)


def recycled(count: int) -> RecycledDraws:
    return case.equal_draws([MEASURED.posterior(0, case.THETA_PRIOR, count, 1)])[0]


def shrunken(model: CohortModel, eta: FloatArray, times: int = 1) -> Shrinkage:
    return shrink(model, np.tile(eta, (times, 1)), np.random.default_rng(3))


def test_the_subject_within_a_known_population_is_that_of_its_prior() -> None:
    draws = recycled(20_000)
    shrinkage = shrunken(model_of(draws), ETA, 300)
    expected = MEASURED.posterior(0, of_population(ETA), 100_000, 2)
    found = weighted_quantiles(draws.theta, shrinkage.weights[0], LEVELS)
    assert found == pytest.approx(np.quantile(expected, LEVELS, axis=0), rel=0.03)
    assert np.log(found[1, 0] / np.median(draws.theta[:, 0])) < -0.1
    joint = draws.theta[shrinkage.rows[:, 0]]
    assert np.median(joint, axis=0) == pytest.approx(found[1], rel=0.06)


def test_an_outlier_keeps_its_own_answer() -> None:
    draws, far = recycled(4000), ETA * np.array([0.4, 0.5, 0.3, 0.5, 0.5, 0.5])
    model = model_of(draws, 0.9)
    shrinkage = shrunken(model, far, 50)
    assert shrinkage.outlier[0] > 0.99
    found = weighted_quantiles(draws.theta, shrinkage.weights[0], LEVELS)
    assert found == pytest.approx(np.quantile(draws.theta, LEVELS, axis=0), rel=0.02)
    for eta in (far, ETA):
        assert shrunken(model, eta).log_likelihood == pytest.approx(model.by_subject(eta[None]))


def test_draws_made_anew_are_weighted_to_the_first_posterior() -> None:
    first = recycled(4000)
    model = model_of(first)
    narrow = shrunken_prior(model, NARROW[None], 0)
    anew = MEASURED.posterior(0, narrow, 4000, 5)
    both = combined([DrawSet(first.theta, case.THETA_PRIOR), DrawSet(anew, narrow)])
    weight = np.exp(both.log_weight)
    assert weight.sum() == pytest.approx(1.0)
    exact = MEASURED.posterior(0, case.THETA_PRIOR, 200_000, 8)
    assert weight @ np.log(both.theta) == pytest.approx(np.log(exact).mean(axis=0), abs=0.03)
    # where the population lies, which the first draws hardly reach, the evidence is that of many draws
    ratio = log_density(exact, of_population(NARROW)) - log_density(exact, case.THETA_PRIOR)
    right = np.log(np.exp(ratio).mean())
    weighted, unweighted = (
        float(model_of(each).by_subject(NARROW[None])[0, 0])
        for each in (both, case.equal_draws([both.theta])[0])
    )
    assert weighted == pytest.approx(right, abs=0.12)
    assert abs(unweighted - right) > 0.3
    assert shrunken(model_of(both), NARROW).effective[0] > 5.0 * shrunken(model, NARROW).effective[0]


def test_sets_of_one_prior_count_alike() -> None:
    theta = MEASURED.posterior(0, case.THETA_PRIOR, 600, 1)
    both = combined([DrawSet(theta[:200], case.THETA_PRIOR), DrawSet(theta[200:], case.THETA_PRIOR)])
    assert both.log_weight == pytest.approx(-np.log(600.0))
    assert np.array_equal(both.theta, theta)
