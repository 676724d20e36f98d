"""The likelihood of a population: against its closed form, and against what it must not depend on."""

from __future__ import annotations

from dataclasses import replace

import hierarchy_case as case
import numpy as np
import pytest
from mpmath import log, mp, mpf, ncdf

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.cohort import design_of, in_rows
from swesbi.persons.cohort.model import CohortModel, PriorAlone, log_normal_mass, population_law
from swesbi.prior import draw_prior

SUBJECTS = 6
DRAWS = 40_000


Cohort = tuple[CohortModel, FloatArray, FloatArray]


@pytest.fixture(scope="module")
def cohort() -> Cohort:
    """A model, eta about what the subjects are like, where recycled draws are many, and its closed form."""
    rng = np.random.default_rng(3)
    design = design_of(case.blank(case.contexts(SUBJECTS, rng)))
    prior = case.hyperprior(design)
    measured = case.draw_members(draw_prior(prior, 1, rng)[0], design, np.zeros(SUBJECTS), rng)
    theta = [measured.posterior(d, case.THETA_PRIOR, DRAWS, d) for d in range(SUBJECTS)]
    model = CohortModel(
        PriorAlone(prior), case.equal_draws(theta), design.matrix, np.zeros(SUBJECTS), case.THETA_PRIOR
    )
    eta = draw_prior(prior, 40, np.random.default_rng(5))
    rows = in_rows(eta).copy()
    rows[:, 0] = np.clip(np.exp(np.median(measured.log_theta, axis=0)), [11, 2.1, 2.1], [190, 28, 58])
    rows[:, 1] = np.clip(rows[:, 1], 0.25, 1.0)
    mean, spread = population_law(np.log(rows), design.matrix)
    centre, prior_sd, _, _ = case.law_of(case.THETA_PRIOR)
    of_prior = np.broadcast_to(centre, mean.shape), np.broadcast_to(prior_sd, spread.shape)
    right, alone = (measured.log_evidence(*law, case.THETA_PRIOR) for law in ((mean, spread), of_prior))
    return model, rows.reshape(eta.shape), right - alone


def test_recycled_draws_give_the_evidence_in_closed_form(cohort: Cohort) -> None:
    model, eta, right = cohort
    assert model.by_subject(eta) == pytest.approx(right, abs=0.1)


def test_an_outlier_tells_nothing_of_the_population(cohort: Cohort) -> None:
    model, eta, _ = cohort
    p = np.array([0.0, 0.02, 0.2, 0.5, 0.9, 0.999999])
    plain, mixed = model.by_subject(eta[:5]), replace(model, outlier=p).by_subject(eta[:5])
    assert mixed == pytest.approx(np.log((1.0 - p) * np.exp(plain) + p))
    assert np.abs(mixed[:, -1]).max() < 1e-2


def test_blocks_and_subjects_do_not_matter(cohort: Cohort) -> None:
    model, few, _ = cohort
    small = replace(model, recycled=case.equal_draws([draws.theta[:100] for draws in model.recycled]))
    eta = np.tile(few, (15, 1))
    assert small.by_subject(eta)[300:301] == pytest.approx(small.by_subject(eta[300:301]), rel=1e-12)
    assert small.log_likelihood(eta) == pytest.approx(small.by_subject(eta).sum(axis=1))


@pytest.mark.parametrize(("low", "high"), [(-1.0, 2.0), (-40.0, -39.0), (39.0, 40.0), (-50.0, 50.0)])
def test_the_mass_between_limits_holds_in_both_tails(low: float, high: float) -> None:
    mp.dps = 800
    expected = float(log(ncdf(mpf(high)) - ncdf(mpf(low))))
    assert float(log_normal_mass(np.array(low), np.array(high))) == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )
