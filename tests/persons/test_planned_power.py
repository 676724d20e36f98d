"""Power from a bank, on persons whose posteriors are known in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import hierarchy_case as case
import numpy as np
import plan_case
import pytest
import ratio_case
from scipy.special import ndtr, ndtri
from speed_case import shipped

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.persons.cohort.cohort import Member
from swesbi.persons.planning.effect import log_factor
from swesbi.persons.planning.likelihoods import Likelihoods, likelihoods_of
from swesbi.persons.planning.power import (
    Plan,
    draw_counts,
    one_person_power,
    persons_for,
    plan_lines,
    plan_table,
    power_curve,
)
from swesbi.persons.planning.simulation import ARMS, EFFECT, Bank
from swesbi.persons.settings import GROUPS, PAIRED
from swesbi.prior import even_quantiles
from swesbi.report.figures.change import draw_plan

RULE = (0.95, 0.8)
PERSONS = 40
FRESH = 2400
"""Persons of whom fresh studies are made."""
K_SR = plan_case.EFFECT.number


def likelihoods_of_bank(bank: Bank, design: str) -> Likelihoods:
    return likelihoods_of(bank, design, plan_case.EFFECT, plan_case.BY)


@pytest.fixture(scope="module")
def bank() -> Bank:
    return plan_case.bank(PERSONS, PAIRED, 1)


@pytest.fixture(scope="module")
def likelihoods(bank: Bank) -> Likelihoods:
    return likelihoods_of_bank(bank, PAIRED)


@pytest.fixture(scope="module")
def of_groups() -> Likelihoods:
    return likelihoods_of_bank(plan_case.bank(PERSONS, GROUPS, 2), GROUPS)


@pytest.mark.parametrize("design", [PAIRED, GROUPS])
def test_summaries_lead_back_to_what_was_measured(design: str) -> None:
    """Measured with a known error and the prior of theta: middle and variance are of the measurement."""
    values, truth = plan_case.drawn(30, design, 3, 4000)
    found = likelihoods_of_bank(plan_case.bank_of_draws(values, truth, design), design)
    error = ratio_case.ERROR_SD[K_SR] * np.sqrt(2.0) if design == PAIRED else case.ERROR_SD[K_SR]
    assert np.median(found.covariance[:, :, K_SR, K_SR]) == pytest.approx(error**2, rel=0.1)
    apart = (found.middle - np.log(truth))[:, :, K_SR] / error
    assert apart.std() == pytest.approx(1.0, abs=0.25)


def planned(design: str, seed: int) -> tuple[FloatArray, Likelihoods]:
    """Return draws of a bank's persons in both arms, and their likelihoods."""
    values, truth = plan_case.drawn(PERSONS, design, seed, 1000)
    return values, likelihoods_of_bank(plan_case.bank_of_draws(values, truth, design), design)


def members(draws: FloatArray, groups: Sequence[str]) -> list[Member]:
    """Return persons alike in all but their draws (d, n, 3) and groups."""
    contexts = case.contexts(len(draws), np.random.default_rng(1), "F")
    return [
        Member(replace(context, age_years=40.0, hr_bpm=65.0), "not contradicted", group, own, own[:3])
        for context, group, own in zip(contexts, groups, draws, strict=True)
    ]


@pytest.mark.parametrize("size", [6, 14])
def test_a_study_on_the_grid_is_what_its_own_posterior_says(size: int) -> None:
    values, likelihoods = planned(PAIRED, 1)
    for first in (0, 14):
        chosen = np.arange(first, first + size)
        own = ratio_case.infer(members(values[ARMS.index(EFFECT)][chosen], [""] * size))
        counts = np.zeros((PERSONS, 1))
        counts[chosen] = 1.0
        below = (own.exact.phi[:, K_SR] < 1.0).mean()
        assert likelihoods.probability(counts, counts, EFFECT)[0] == pytest.approx(below, abs=0.04)


def test_two_groups_on_the_grid_are_what_their_own_posterior_says() -> None:
    values, likelihoods = planned(GROUPS, 2)
    draws = np.concatenate([values[0][:12], values[1][12:24]])
    own = case.infer(members(draws, ["control"] * 12 + ["treated"] * 12), plan_case.BY.cohort, None, 1)
    below = (own.exact.phi[:, 6 + K_SR] < 1.0).mean()
    treated, control = np.zeros((2, PERSONS, 1))
    control[:12] = treated[12:24] = 1.0
    assert likelihoods.probability(treated, control, EFFECT)[0] == pytest.approx(below, abs=0.06)


def test_correlated_errors_are_found_behind_a_posterior_and_its_prior(bank: Bank) -> None:
    """Errors of k_0 and k_ATP are correlated as those of hearts are; parameter by parameter it fails."""
    rng, sd = np.random.default_rng(5), 1.5 * ratio_case.ERROR_SD
    log_theta = np.log(even_quantiles(case.THETA_PRIOR))
    prior = np.diag(2.0 * log_theta.var(axis=0))
    error = sd[:, None] * np.array([[1.0, -0.85, 0.0], [-0.85, 1.0, 0.2], [0.0, 0.2, 1.0]]) * sd
    measured = 0.2 * rng.standard_normal((PERSONS, 2, 3))
    within = np.linalg.inv(np.linalg.inv(error) + np.linalg.inv(prior))
    of_normals = replace(
        bank,
        mean=measured @ np.linalg.inv(error) @ within,
        covariance=np.broadcast_to(within, (PERSONS, 2, 3, 3)),
    )
    found = likelihoods_of_bank(of_normals, PAIRED)
    assert found.middle == pytest.approx(measured.swapaxes(0, 1), abs=1e-9)
    assert found.covariance == pytest.approx(np.broadcast_to(error, (2, PERSONS, 3, 3)), abs=1e-9)


def test_power_is_near_that_of_normal_theory(likelihoods: Likelihoods) -> None:
    curve = power_curve(likelihoods, 3, plan_case.STUDIES, RULE, 1)
    assert (np.diff(curve.power) > -0.1).all()
    truly = plan_case.VISIT_SPREAD[K_SR] ** 2 + plan_case.RESPONSE_SPREAD**2
    sd = np.sqrt(truly + likelihoods.covariance[:, :, K_SR, K_SR].mean())
    theory = ndtr(np.sqrt(curve.sizes) * abs(log_factor(plan_case.EFFECT)) / sd - ndtri(0.95))
    assert np.abs(curve.power - theory)[1:].max() < 0.2
    assert curve.power[-1] > 0.9
    assert (curve.power_se > 0.0).any()
    assert curve.false_positive.max() < 0.12
    number, fewest, most = curve.needed
    assert number is not None and fewest is not None and fewest <= number
    assert most is None or most >= number


def test_studies_are_drawn_with_replacement_from_the_bank_that_is_given() -> None:
    rng = np.random.default_rng(1)
    counts = draw_counts(np.array([0, 0, 3]), 5, 30, 40, rng)
    assert (counts.sum(axis=0) == 30).all()
    assert not counts[[1, 2, 4]].any()
    assert counts[0].mean() == pytest.approx(20, abs=2)


@pytest.mark.parametrize("design", [PAIRED, GROUPS])
def test_moving_all_likelihoods_is_moving_those_who_have_the_effect(
    design: str, likelihoods: Likelihoods, of_groups: Likelihoods
) -> None:
    whole = likelihoods if design == PAIRED else of_groups
    rng, by = np.random.default_rng(3), 0.05
    counts, control = (draw_counts(np.arange(PERSONS), PERSONS, 12, 20, rng) for _ in range(2))
    middle = whole.middle.copy()
    middle[ARMS.index(EFFECT), :, K_SR] += by
    elsewhere = replace(whole, middle=middle)
    moved = whole.probability(counts, control, EFFECT, by)
    assert moved == pytest.approx(elsewhere.probability(counts, control, EFFECT), abs=0.01)
    assert np.abs(moved - whole.probability(counts, control, EFFECT)).max() > 0.05


def test_luck_of_responses_and_of_recordings_is_taken_off_pairs() -> None:
    """Middle answers of many banks scatter less about the effect, which they have."""
    found = []
    for seed in range(25):
        own = likelihoods_of_bank(plan_case.bank(PERSONS, PAIRED, 100 + seed, 40), PAIRED)
        usual = own.covariance[:, :, K_SR, K_SR].mean(axis=0) + own.hyperprior.spread.centre**2
        found_by = float(np.average(own.middle[1, :, K_SR], weights=1.0 / usual))
        surplus = found_by - log_factor(plan_case.EFFECT)
        found.append((surplus, surplus + own.displacement(np.arange(PERSONS))))
    before, after = np.std(found, axis=0)
    assert after < 0.6 * before
    assert np.abs(np.mean(found, axis=0)[1]) < 0.01


def test_of_groups_luck_of_responses_is_taken_off(of_groups: Likelihoods) -> None:
    alike = replace(of_groups, covariance=np.ones_like(of_groups.covariance))
    assert alike.displacement(np.arange(PERSONS)) == pytest.approx(-of_groups.response.mean())


def test_a_bank_of_few_persons_makes_the_error_larger(bank: Bank) -> None:
    def error(persons: int) -> float:
        found = likelihoods_of_bank(bank.before(persons), PAIRED)
        return float(power_curve(found, 3, plan_case.STUDIES, RULE, 1).power_se.mean())

    assert error(6) > error(PERSONS)


@pytest.mark.parametrize(
    ("found", "needed"),
    [([0.2, 0.5, 0.85, 1.0], 15), ([0.9, 0.95, 1.0, 1.0], 4), ([0.1, 0.2, 0.3, 0.7], None)],
)
def test_the_number_of_persons_is_where_power_crosses(found: list[float], needed: int | None) -> None:
    assert persons_for(0.8, [4, 9, 16, 25], np.array(found)) == needed


def test_the_answer_says_what_is_needed_and_what_it_assumes(likelihoods: Likelihoods, bank: Bank) -> None:
    curve = power_curve(likelihoods, 3, plan_case.STUDIES, RULE, 1)
    own = one_person_power(bank, plan_case.EFFECT, 0.95)
    assert one_person_power(plan_case.bank(4, GROUPS, 3), plan_case.EFFECT, 0.95) is None  # who came once
    planned = Plan(plan_case.EFFECT, PAIRED, 0.8, 0.03, 16, (curve,), {3: own}, shipped().plan, (0.1, 0.95))
    lines = plan_lines(planned)
    said = "\n".join(lines)
    assert f"{curve.needed[0]} persons, each recorded twice" in said
    assert "16 persons, each recorded twice: power" in said
    assert "one person: a change beyond 10% is called" in said
    table = plan_table(planned)
    assert list(table["persons"]) == list(plan_case.STUDIES.sizes)
    assert len(draw_plan(planned).axes) == 1
    none = replace(planned, curves=(replace(curve, needed=(None, None, None)),))
    assert "is not reached by 32 persons" in "\n".join(plan_lines(none))


class _AsItIs(Likelihoods):
    """Likelihoods from which no chance variation is taken off."""

    def displacement(self, persons: IntArray) -> float:
        return 0.0


@pytest.mark.slow(minutes=0.5)
def test_banks_of_much_luck_plan_the_right_size_but_not_as_they_are() -> None:
    """Chance variation of one bank asks for too many persons, and that of the other for too few."""
    settings = plan_case.STUDIES.model_copy(update={"sizes": (8, 11, 14, 17, 20, 24, 28), "studies": 600})
    fresh = likelihoods_of_bank(plan_case.bank(FRESH, PAIRED, 9), PAIRED)

    def reached(planned_by: Likelihoods, seed: int) -> float:
        """Return the power of fresh studies of the size that is planned, each person in one at most."""
        size = power_curve(planned_by, 3, settings, RULE, seed).needed[0] or settings.sizes[-1]
        counts = np.kron(np.eye(FRESH // size), np.ones((size, 1)))
        counts = np.vstack([counts, np.zeros((FRESH - len(counts), counts.shape[1]))])
        return float((fresh.probability(counts, counts, EFFECT) > RULE[0]).mean())

    power, as_it_is = [], []
    for seed in (1, 2):
        own = likelihoods_of_bank(plan_case.bank(shipped().plan.persons.number, PAIRED, seed), PAIRED)
        power.append(reached(own, seed))
        as_it_is.append(reached(_AsItIs(*(getattr(own, each.name) for each in fields(own))), seed))
    assert power == pytest.approx([RULE[1]] * 2, abs=0.06)
    assert min(as_it_is) < RULE[1] - 0.08
    assert max(as_it_is) > RULE[1] + 0.08
