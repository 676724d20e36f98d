"""The posterior of a cohort is the one known without recycling; hyperparameters are calibrated."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import hierarchy_case as case
import numpy as np
import pytest
import separable_case as separable
from scipy.stats import binom, ks_2samp, kstest
from together_case import joint_accuracy

from swesbi.persons.cohort import infer as inference
from swesbi.persons.cohort import model as population_model
from swesbi.persons.cohort.cohort import Design, Member, design_of
from swesbi.persons.cohort.hyperprior import Hyperprior, hyperprior_of
from swesbi.persons.cohort.infer import CohortResult
from swesbi.persons.cohort.refresh import DrawSet
from swesbi.prior import PriorSettings, draw_prior

COHORTS = 40
PERSONS = 12
ALL_NOT_CONTRADICTED = case.SETTINGS.model_copy(
    update={
        "outliers": case.OUTLIERS.model_copy(update={"not_contradicted": 0.0}),
        "least_effective": 250.0,
    }
)
"""Nobody is an outlier, so that parameters are apart; some persons are drawn anew."""
AWAY = np.r_[[25.0, 9.0, 16.0], [0.2] * 3, [1.0] * 9]
"""Medians far from the centre of the prior of theta; spreads, and what age, sex and heart rate do."""
EXACT_DRAWS = 2000
OF_HYPERPARAMETERS = 0.13
"""Largest Kolmogorov-Smirnov distance of 400 from 500 effective draws, but for one in a thousand."""
OF_PERSONS = 0.17
"""The same of 500 draws of persons with 250 effective ones each."""


def away() -> tuple[list[Member], Design, Hyperprior, case.Measured]:
    """Persons of a population far from the prior's centre, measured."""
    rng = np.random.default_rng(1)
    contexts, none = case.contexts(PERSONS, rng), np.empty((0, 3))
    design = design_of([Member(context, "not contradicted", "", none, none) for context in contexts])
    prior = hyperprior_of(design, case.THETA_PRIOR.parameters, case.HYPERPRIOR)
    _, measured = case.draw_members(AWAY, design, np.zeros(PERSONS), rng)
    members = case.members_of(measured, contexts, ["not contradicted"] * PERSONS, [""] * PERSONS, 4000)
    return members, design, prior, measured


@cache
def known() -> tuple[case.FloatArray, case.FloatArray]:
    """Hyperparameters (n, k) and theta of the persons (n, d, 3) by closed form."""
    _, design, prior, measured = away()
    rng = np.random.default_rng(2)
    eta = separable.draw_eta(prior, design, separable.closed_form(measured), EXACT_DRAWS, rng)
    return eta, separable.draw_theta(eta, design, measured, rng)


def recycled() -> CohortResult:
    """The same posterior from recycled draws, with draws anew."""
    members, _, _, measured = away()

    def redraw(subject: str, narrower: PriorSettings, stream: int) -> case.FloatArray:
        return measured.posterior(int(subject[1:]), narrower, ALL_NOT_CONTRADICTED.draws, stream)

    return case.infer(members, ALL_NOT_CONTRADICTED, redraw, 1)


def distances(found: CohortResult) -> tuple[float, float]:
    """Largest distance between hyperparameters; between persons, alone and beside the median of all."""
    eta, theta = known()
    rows = found.shrinkage.rows
    persons = np.stack([one.theta[rows[:, d]] for d, one in enumerate(found.model.recycled)], axis=1)
    ours = np.hstack([each.reshape(len(each), -1) for each in (persons, persons / found.eta[:, None, :3])])
    theirs = np.hstack([each.reshape(len(each), -1) for each in (theta, theta / eta[:, None, :3])])
    return largest_distance(found.exact.phi, eta), largest_distance(ours, theirs)


def largest_distance(ours: case.FloatArray, theirs: case.FloatArray) -> float:
    return max(float(ks_2samp(*pair).statistic) for pair in zip(ours.T, theirs.T, strict=True))


@pytest.mark.slow(minutes=0.1)
def test_recycling_gives_the_posterior_that_is_known_without_it() -> None:
    found = recycled()
    assert any(found.refreshed)
    of_hyperparameters, of_persons = distances(found)
    assert of_hyperparameters < OF_HYPERPARAMETERS
    assert of_persons < OF_PERSONS


def no_division(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(population_model, "log_density", lambda theta, prior: -np.log(theta).sum(axis=1))


def anew_as_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draws made anew under a narrower prior count as made under the first."""
    monkeypatch.setattr(inference, "DrawSet", lambda theta, prior: DrawSet(theta, case.THETA_PRIOR))


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("broken", [no_division, anew_as_first])
def test_recycling_that_is_broken_gives_another_posterior(
    broken: Callable[[pytest.MonkeyPatch], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    known()
    broken(monkeypatch)
    of_hyperparameters, of_persons = distances(recycled())
    assert of_hyperparameters > 2.0 * OF_HYPERPARAMETERS
    assert of_persons > 1.5 * OF_PERSONS


def levels() -> case.FloatArray:
    """Return where the truth lies in each hyperparameter's draws; shape (cohorts, k)."""
    found = []
    for seed in range(COHORTS):
        rng = np.random.default_rng(1000 + seed)
        contexts = [context for context in case.contexts(PERSONS, rng, "F")]
        none = np.empty((0, 3))
        design = design_of([Member(context, "not contradicted", "", none, none) for context in contexts])
        prior = hyperprior_of(design, case.THETA_PRIOR.parameters, case.HYPERPRIOR)
        eta = draw_prior(prior, 1, rng)[0]
        _, measured = case.draw_members(eta, design, np.full(PERSONS, case.OUTLIERS.not_contradicted), rng)
        members = case.members_of(measured, contexts, ["not contradicted"] * PERSONS, [""] * PERSONS, 4000)

        def redraw(
            subject: str, narrower: PriorSettings, stream: int, measured: case.Measured = measured
        ) -> case.FloatArray:
            return measured.posterior(int(subject[1:]), narrower, case.SETTINGS.draws, stream)

        inferred = case.infer(members, case.SETTINGS, redraw, seed)
        found.append((inferred.exact.phi < eta).mean(axis=0))
    return np.array(found)


@pytest.mark.exhaustive
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    level = levels()
    p_values = [float(kstest(column, "uniform").pvalue) for column in level.T]
    assert min(p_values) > 0.01 / len(p_values)
    inside = ((level > 0.05) & (level < 0.95)).sum(axis=0)
    low, high = binom.ppf([0.0005, 0.9995], COHORTS, 0.9)
    assert ((inside >= low) & (inside <= high)).all()
    assert inside.mean() / COHORTS == pytest.approx(0.9, abs=0.04)


@pytest.mark.exhaustive
def test_without_the_division_by_the_prior_intervals_miss(monkeypatch: pytest.MonkeyPatch) -> None:
    no_division(monkeypatch)
    level = levels()
    assert min(float(kstest(column, "uniform").pvalue) for column in level.T) < 1e-4


@pytest.mark.exhaustive
def test_six_persons_are_what_mcmc_over_everything_gives() -> None:
    accuracy, distinct = joint_accuracy(case.SETTINGS, 1)
    assert 0.47 < accuracy < 0.53
    assert distinct >= 2000
