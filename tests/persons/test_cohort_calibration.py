"""The posterior of a cohort is the one known without recycling; hyperparameters are calibrated."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import hierarchy_case as case
import numpy as np
import pytest
from scipy.stats import binom, ks_2samp, kstest

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort import infer as inference
from swesbi.persons.cohort import model as population_model
from swesbi.persons.cohort.cohort import design_of
from swesbi.persons.cohort.model import DrawSet
from swesbi.prior import draw_prior

COHORTS = 40
PERSONS = 12
ALL_NOT_CONTRADICTED = case.SETTINGS.model_copy(
    update={"outliers": case.OUTLIERS.model_copy(update={"not_contradicted": 0.0}), "least_effective": 250.0}
)
"""Nobody is an outlier, so that parameters are apart; some persons are drawn anew."""
AWAY = np.r_[[25.0, 9.0, 16.0], [0.2] * 3, [1.0] * 9]
"""Medians far from the centre of the prior of theta; spreads, and what age, sex and heart rate do."""
OF_HYPERPARAMETERS = 0.13
"""Largest Kolmogorov-Smirnov distance of 400 from 500 effective draws, but for one in a thousand."""
OF_PERSONS = 0.17
"""The same of 500 draws of persons with 250 effective ones each."""


@cache
def known() -> tuple[case.Measured, FloatArray, FloatArray]:
    """Measured persons; their hyperparameters (n, k) and theta (n, d, 3) by closed form."""
    rng = np.random.default_rng(1)
    design = design_of(case.blank(case.contexts(PERSONS, rng)))
    measured = case.draw_members(AWAY, design, np.zeros(PERSONS), rng)
    evidence, rng = case.closed_form(measured), np.random.default_rng(2)
    eta = case.draw_eta(case.hyperprior(design), design, evidence, rng)
    return measured, eta, case.draw_theta(eta, design, measured, rng)


def distances() -> tuple[float, float]:
    """Largest distance of hyperparameters from recycled draws, and of persons, alone and over the median."""
    measured, eta, theta = known()
    members = case.members_of(measured, case.contexts(PERSONS, np.random.default_rng(1)))
    found = case.infer(members, ALL_NOT_CONTRADICTED, case.redraw_of(measured), 1)
    assert any(found.refreshed)
    rows = found.shrinkage.rows
    persons = np.stack([one.theta[rows[:, d]] for d, one in enumerate(found.model.recycled)], axis=1)
    ours = np.hstack([each.reshape(len(each), -1) for each in (persons, persons / found.eta[:, None, :3])])
    theirs = np.hstack([each.reshape(len(each), -1) for each in (theta, theta / eta[:, None, :3])])
    return largest_distance(found.exact.phi, eta), largest_distance(ours, theirs)


def largest_distance(ours: FloatArray, theirs: FloatArray) -> float:
    return max(float(ks_2samp(*pair).statistic) for pair in zip(ours.T, theirs.T, strict=True))


@pytest.mark.slow(minutes=0.1)
def test_recycling_gives_the_posterior_that_is_known_without_it() -> None:
    of_hyperparameters, of_persons = distances()
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
    of_hyperparameters, of_persons = distances()
    assert of_hyperparameters > 2.0 * OF_HYPERPARAMETERS
    assert of_persons > 1.5 * OF_PERSONS


def levels() -> FloatArray:
    """Return where the truth lies in each hyperparameter's draws; shape (cohorts, k)."""
    found, outlier = [], np.full(PERSONS, case.OUTLIERS.not_contradicted)
    for seed in range(COHORTS):
        rng = np.random.default_rng(1000 + seed)
        contexts = case.contexts(PERSONS, rng, "F")
        design = design_of(case.blank(contexts))
        eta = draw_prior(case.hyperprior(design), 1, rng)[0]
        measured = case.draw_members(eta, design, outlier, rng)
        members = case.members_of(measured, contexts)
        inferred = case.infer(members, case.SETTINGS, case.redraw_of(measured), seed)
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
