"""A subject within its population, and draws made anew, against closed forms."""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import pytest
from numpy.typing import NDArray

from swesbi.persons.cohort.cohort import Member, design_of, weighted_quantiles
from swesbi.persons.cohort.hyperprior import hyperprior_of
from swesbi.persons.cohort.model import CohortModel, PriorAlone, RecycledDraws
from swesbi.persons.cohort.refresh import DrawSet, combined, shrunken_prior
from swesbi.persons.cohort.shrinkage import shrink
from swesbi.prior import PriorSettings, log_density

FloatArray = NDArray[np.float64]
LEVELS = np.array([0.05, 0.5, 0.95])
ETA = np.array([40.0, 6.0, 25.0, 0.2, 0.3, 0.2])
"""A population without covariates; a subject measured to (70, 6, 40) is far up in it."""
MEASURED = case.Measured(np.log([[70.0, 6.0, 40.0]]), case.ERROR_SD[None])


def of_population(spread: FloatArray = ETA[3:]) -> PriorSettings:
    """Return the prior of theta that a population is."""
    names = ("k0_kpa", "k_atp_per_s", "k_sr_per_s")
    parameters = {
        name: getattr(case.THETA_PRIOR, name).model_copy(
            update={"centre": float(ETA[j]), "log_sd": float(spread[j])}
        )
        for j, name in enumerate(names)
    }
    return case.THETA_PRIOR.model_copy(update=parameters)


def model_of(draws: RecycledDraws, outlier: float = 0.0) -> CohortModel:
    context = case.contexts(1, np.random.default_rng(1))[0]
    design = design_of([Member(context, "not contradicted", "", draws.theta, draws.theta)])
    prior = hyperprior_of(design, case.THETA_PRIOR.parameters, case.HYPERPRIOR)
    return CohortModel(PriorAlone(prior), (draws,), design.matrix, np.array([outlier]), case.THETA_PRIOR)


def recycled(count: int = 20_000) -> RecycledDraws:
    return case.equal_draws([MEASURED.posterior(0, case.THETA_PRIOR, count, 1)])[0]


def test_the_subject_within_a_known_population_is_that_of_its_prior() -> None:
    draws = recycled()
    shrinkage = shrink(model_of(draws), np.tile(ETA, (300, 1)), np.random.default_rng(3))
    expected = MEASURED.posterior(0, of_population(), 100_000, 2)
    found = weighted_quantiles(draws.theta, shrinkage.weights[0], LEVELS)
    assert found == pytest.approx(np.quantile(expected, LEVELS, axis=0), rel=0.03)
    alone = np.quantile(draws.theta, LEVELS, axis=0)
    assert np.log(found[1, 0] / alone[1, 0]) < -0.1
    joint = draws.theta[shrinkage.rows[:, 0]]
    assert np.median(joint, axis=0) == pytest.approx(found[1], rel=0.06)


def test_an_outlier_keeps_its_own_answer() -> None:
    draws = recycled(4000)
    model = model_of(draws, 0.9)
    far = ETA * np.array([0.4, 0.5, 0.3, 0.5, 0.5, 0.5])
    shrinkage = shrink(model, np.tile(far, (50, 1)), np.random.default_rng(3))
    assert shrinkage.outlier[0] > 0.99
    found = weighted_quantiles(draws.theta, shrinkage.weights[0], LEVELS)
    assert found == pytest.approx(np.quantile(draws.theta, LEVELS, axis=0), rel=0.02)
    assert shrinkage.log_likelihood == pytest.approx(model.by_subject(np.tile(far, (50, 1))))


def test_the_effective_number_of_draws_falls_with_the_spread() -> None:
    model = model_of(recycled(2000))
    wide, narrow = (
        shrink(model, np.r_[ETA[:3], [spread] * 3][None], np.random.default_rng(1)).effective[0]
        for spread in (0.4, 0.06)
    )
    assert wide > 200.0
    assert narrow < 20.0


def test_draws_made_anew_are_weighted_to_the_first_posterior() -> None:
    first = recycled(4000)
    eta = np.r_[ETA[:3], [0.08] * 3]
    model = model_of(first)
    narrow = shrunken_prior(model, eta[None], 0)
    anew = MEASURED.posterior(0, narrow, 4000, 5)
    both = combined([DrawSet(first.theta, case.THETA_PRIOR), DrawSet(anew, narrow)])
    weight = np.exp(both.log_weight)
    assert weight.sum() == pytest.approx(1.0)
    exact = MEASURED.posterior(0, case.THETA_PRIOR, 200_000, 8)
    assert weight @ np.log(both.theta) == pytest.approx(np.log(exact).mean(axis=0), abs=0.03)
    # where the population lies, which the first draws hardly reach, the evidence is that of many draws
    population = of_population(np.full(3, 0.08))
    ratio = log_density(exact, population) - log_density(exact, case.THETA_PRIOR)
    right = np.log(np.exp(ratio).mean())
    assert float(model_of(both).by_subject(eta[None])[0, 0]) == pytest.approx(right, abs=0.12)
    unweighted = case.equal_draws([both.theta])[0]
    assert abs(float(model_of(unweighted).by_subject(eta[None])[0, 0]) - right) > 0.3
    effective = shrink(model_of(both), eta[None], np.random.default_rng(1)).effective[0]
    assert effective > 5.0 * shrink(model, eta[None], np.random.default_rng(1)).effective[0]


def test_sets_of_one_prior_count_alike() -> None:
    theta = MEASURED.posterior(0, case.THETA_PRIOR, 600, 1)
    both = combined([DrawSet(theta[:200], case.THETA_PRIOR), DrawSet(theta[200:], case.THETA_PRIOR)])
    assert both.log_weight == pytest.approx(-np.log(600.0))
    assert np.array_equal(both.theta, theta)
