"""Hyperparameters are calibrated, and those of six persons are what MCMC over everything gives.

`benchmarks/cohort_posterior.py` does the same with 200 cohorts of 20.
"""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import pytest
from scipy.stats import binom, kstest
from together_case import joint_accuracy

from swesbi.hierarchy import model as population_model
from swesbi.hierarchy.cohort import Member, design_of
from swesbi.hierarchy.hyperprior import hyperprior_of
from swesbi.hierarchy.infer import infer_cohort
from swesbi.prior import PriorSettings, draw_prior

COHORTS = 40
PERSONS = 12


def levels() -> case.FloatArray:
    """Return where the truth lies in each hyperparameter's draws; shape (cohorts, k)."""
    found = []
    for seed in range(COHORTS):
        rng = np.random.default_rng(1000 + seed)
        contexts = [context for context in case.contexts(PERSONS, rng, "F")]
        none = np.empty((0, 3))
        design = design_of([Member(context, "supported", "", none, none) for context in contexts])
        prior = hyperprior_of(design, case.THETA_PRIOR, case.HYPERPRIOR)
        eta = draw_prior(prior, 1, rng)[0]
        _, measured = case.draw_members(eta, design, np.full(PERSONS, case.OUTLIERS.supported), rng)
        members = case.members_of(measured, contexts, ["supported"] * PERSONS, [""] * PERSONS, 4000)

        def redraw(
            subject: str, narrower: PriorSettings, stream: int, measured: case.Measured = measured
        ) -> case.FloatArray:
            return measured.posterior(int(subject[1:]), narrower, case.SETTINGS.draws, stream)

        inferred = infer_cohort(members, case.THETA_PRIOR, case.SETTINGS, redraw, seed)
        found.append((inferred.exact.phi < eta).mean(axis=0))
    return np.array(found)


@pytest.mark.slow(minutes=3)
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
    monkeypatch.setattr(population_model, "log_density", lambda theta, prior: -np.log(theta).sum(axis=1))
    level = levels()
    assert min(float(kstest(column, "uniform").pvalue) for column in level.T) < 1e-4


@pytest.mark.slow(minutes=3)
def test_six_persons_are_what_mcmc_over_everything_gives() -> None:
    accuracy, distinct = joint_accuracy(case.SETTINGS, 1)
    assert 0.47 < accuracy < 0.53
    assert distinct >= 2000
