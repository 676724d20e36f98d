"""The likelihood of a population: against its closed form, and against what it must not depend on."""

from __future__ import annotations

from dataclasses import replace

import hierarchy_case as case
import numpy as np
import pytest
from numpy.typing import NDArray

from swesbi.persons.cohort import model as population_model
from swesbi.persons.cohort.cohort import Member, design_of
from swesbi.persons.cohort.hyperprior import hyperprior_of, in_rows
from swesbi.persons.cohort.model import (
    CohortModel,
    PriorAlone,
    population_law,
)
from swesbi.persons.cohort.ratio import log_normal_mass
from swesbi.prior import draw_prior

FloatArray = NDArray[np.float64]
SUBJECTS = 6
DRAWS = 40_000


@pytest.fixture(scope="module")
def cohort() -> tuple[CohortModel, case.Measured]:
    rng = np.random.default_rng(3)
    contexts = case.contexts(SUBJECTS, rng)
    none = np.empty((0, 3))
    design = design_of([Member(context, "not contradicted", "", none, none) for context in contexts])
    prior = hyperprior_of(design, case.THETA_PRIOR.parameters, case.HYPERPRIOR)
    eta = draw_prior(prior, 1, rng)[0]
    _, measured = case.draw_members(eta, design, np.zeros(SUBJECTS), rng)
    theta = [measured.posterior(d, case.THETA_PRIOR, DRAWS, d) for d in range(SUBJECTS)]
    model = CohortModel(
        PriorAlone(prior), case.equal_draws(theta), design.matrix, np.zeros(SUBJECTS), case.THETA_PRIOR
    )
    return model, measured


def near(model: CohortModel, measured: case.Measured, count: int) -> FloatArray:
    """Return eta about what the subjects are like, where recycled draws are many."""
    eta = draw_prior(model.settings.prior, count, np.random.default_rng(5))
    rows = in_rows(eta).copy()
    rows[:, 0] = np.clip(np.exp(np.median(measured.log_theta, axis=0)), [11, 2.1, 2.1], [190, 28, 58])
    rows[:, 1] = np.clip(rows[:, 1], 0.25, 1.0)
    return rows.reshape(eta.shape)


def closed_form(model: CohortModel, measured: case.Measured, eta: FloatArray) -> FloatArray:
    mean, spread = population_law(np.log(in_rows(eta)), model.design)
    parameters = case.THETA_PRIOR.parameters
    centre = np.broadcast_to(np.log([parameter.centre for parameter in parameters]), mean.shape)
    prior_sd = np.broadcast_to([parameter.log_sd for parameter in parameters], spread.shape)
    return measured.log_evidence(mean, spread, case.THETA_PRIOR) - measured.log_evidence(
        centre, prior_sd, case.THETA_PRIOR
    )


def test_recycled_draws_give_the_evidence_in_closed_form(cohort: tuple[CohortModel, case.Measured]) -> None:
    model, measured = cohort
    eta = near(model, measured, 40)
    assert model.by_subject(eta) == pytest.approx(closed_form(model, measured, eta), abs=0.1)


def test_without_truncation_it_would_differ(
    cohort: tuple[CohortModel, case.Measured], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, measured = cohort
    eta = near(model, measured, 40)
    right = closed_form(model, measured, eta)
    monkeypatch.setattr(population_model, "log_normal_mass", lambda low, high: np.zeros_like(low))
    assert np.abs(model.by_subject(eta) - right).max() > 0.3


def test_without_the_division_by_the_prior_it_would_differ(
    cohort: tuple[CohortModel, case.Measured], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, measured = cohort
    eta = near(model, measured, 40)
    right = closed_form(model, measured, eta)
    monkeypatch.setattr(population_model, "log_density", lambda theta, prior: np.zeros(len(theta)))
    broken = replace(model)  # without the features that are kept
    difference = broken.by_subject(eta) - right
    assert np.ptp(difference - difference.mean(axis=0), axis=0).max() > 0.1


def test_an_outlier_tells_nothing_of_the_population(cohort: tuple[CohortModel, case.Measured]) -> None:
    model, measured = cohort
    eta = near(model, measured, 5)
    p = np.array([0.0, 0.02, 0.2, 0.5, 0.9, 0.999999])
    plain, mixed = model.by_subject(eta), replace(model, outlier=p).by_subject(eta)
    assert mixed == pytest.approx(np.log((1.0 - p) * np.exp(plain) + p))
    assert np.abs(mixed[:, -1]).max() < 1e-2


def test_blocks_and_subjects_do_not_matter(cohort: tuple[CohortModel, case.Measured]) -> None:
    model, measured = cohort
    small = replace(model, recycled=case.equal_draws([draws.theta[:100] for draws in model.recycled]))
    eta = near(model, measured, 600)
    assert small.by_subject(eta)[300:301] == pytest.approx(small.by_subject(eta[300:301]), rel=1e-12)
    assert small.log_likelihood(eta) == pytest.approx(small.by_subject(eta).sum(axis=1))


@pytest.mark.parametrize(("low", "high"), [(-1.0, 2.0), (-40.0, -39.0), (39.0, 40.0), (-50.0, 50.0)])
def test_the_mass_between_limits_holds_in_both_tails(low: float, high: float) -> None:
    from mpmath import log, mp, mpf, ncdf

    mp.dps = 800
    expected = float(log(ncdf(mpf(high)) - ncdf(mpf(low))))
    assert float(log_normal_mass(np.array(low), np.array(high))) == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )
