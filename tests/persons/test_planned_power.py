"""Power from a bank, on persons whose posteriors are known in closed form."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import hierarchy_case as case
import numpy as np
import plan_case
import pytest
from scipy.special import ndtr, ndtri, softmax
from speed_case import shipped

from swesbi.base.arrays import FloatArray
from swesbi.persons.change.groups import infer_change_groups
from swesbi.persons.cohort.cohort import Member
from swesbi.persons.planning.bank import ARMS, BY_ARM, EFFECT, NONE, Bank
from swesbi.persons.planning.chance import Chance, chance_of
from swesbi.persons.planning.effect import log_factor
from swesbi.persons.planning.hyperdraws import Likelihoods, evaluate_bank, planned_design
from swesbi.persons.planning.power import (
    draw_counts,
    judge_studies,
    one_person_power,
    persons_for,
    power_curve,
)
from swesbi.persons.planning.settings import GROUPS, PAIRED
from swesbi.persons.planning.words import Plan, plan_lines, plan_table
from swesbi.report.figures.plan import draw_plan

RULE = (0.95, 0.8)
PERSONS = 40
FRESH = 2400
"""Persons of whom fresh studies are made."""


@pytest.fixture(scope="module")
def bank() -> Bank:
    return plan_case.bank(PERSONS, PAIRED, 1)


@pytest.fixture(scope="module")
def chance(bank: Bank) -> Chance:
    return chance_of(bank, PAIRED, plan_case.EFFECT, plan_case.BY)


@pytest.fixture(scope="module")
def likelihoods(bank: Bank) -> Likelihoods:
    return evaluate_bank(bank, PAIRED, plan_case.STUDIES, plan_case.BY, 1)


def test_a_study_at_common_hyperparameters_is_what_its_own_posterior_says(
    bank: Bank, likelihoods: Likelihoods
) -> None:
    chosen = np.arange(10)
    members = [
        Member(context, "not contradicted", "", draws, draws[:3])
        for context, draws in zip(
            case.contexts(len(chosen), np.random.default_rng(1)), bank.of_arm(EFFECT)[chosen], strict=True
        )
    ]
    own = infer_change_groups(members, case.THETA_PRIOR, plan_case.BY.changes, plan_case.BY.cohort, 1)
    below = (own.exact.phi[:, plan_case.EFFECT.number] < 1.0).mean()
    counts = np.zeros((PERSONS, 1))
    counts[chosen] = 1.0
    found = judge_studies(likelihoods, counts, counts, EFFECT, plan_case.EFFECT)
    assert found.effective[0] > plan_case.STUDIES.least_effective
    assert found.probability[0] == pytest.approx(below, abs=0.05)


def test_power_is_near_that_of_normal_theory(likelihoods: Likelihoods, chance: Chance, bank: Bank) -> None:
    curve = power_curve(likelihoods, chance, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1)
    assert (np.diff(curve.power) > -0.1).all()
    draws = np.log(bank.of_arm(EFFECT)[:, :, plan_case.EFFECT.number])
    truly = plan_case.VISIT_SPREAD[plan_case.EFFECT.number] ** 2 + plan_case.RESPONSE_SPREAD**2
    sd = np.sqrt(truly + draws.var(axis=1).mean())
    theory = ndtr(np.sqrt(curve.sizes) * abs(log_factor(plan_case.EFFECT)) / sd - ndtri(0.95))
    assert np.abs(curve.power - theory)[1:].max() < 0.2
    assert curve.power[-1] > 0.9
    assert curve.false_positive.max() < 0.12
    assert (curve.rough < 0.2).all()
    number, fewest, most = curve.needed
    assert number is not None
    assert fewest is not None
    assert fewest <= number
    assert most is None or most >= number
    assert (curve.power_se > 0.0).any()


def test_two_groups_need_more_persons_than_two_visits(likelihoods: Likelihoods, chance: Chance) -> None:
    of_groups = plan_case.bank(PERSONS, GROUPS, 2)
    evaluated = evaluate_bank(of_groups, GROUPS, plan_case.STUDIES, plan_case.BY, 1)
    own = chance_of(of_groups, GROUPS, plan_case.EFFECT, plan_case.BY)
    paired, grouped = (
        power_curve(*each, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1)
        for each in ((likelihoods, chance), (evaluated, own))
    )
    assert grouped.power[2:].mean() < paired.power[2:].mean()
    assert planned_design(GROUPS, [False, True]).matrix.tolist() == [[0.0], [1.0]]


def test_studies_are_drawn_with_replacement_from_the_bank_that_is_given() -> None:
    rng = np.random.default_rng(1)
    counts = draw_counts(np.array([0, 0, 3]), 5, 30, 40, rng)
    assert (counts.sum(axis=0) == 30).all()
    assert not counts[[1, 2, 4]].any()
    assert counts[0].mean() == pytest.approx(20, abs=2)


def test_moving_all_likelihoods_is_moving_the_draws(bank: Bank, likelihoods: Likelihoods) -> None:
    """Draws that are moved, each over the prior where it was made, make a study say the same."""
    by, number, of_study = 0.05, plan_case.EFFECT.number, slice(0, 12)
    here = bank.of_arm(EFFECT)[of_study]
    there = here.copy()
    there[..., number] *= np.exp(by)
    moved = plan_case.by_person(there, likelihoods, made_at=here)

    def middle(persons: FloatArray, displacement: float) -> float:
        log_effect, log_base = likelihoods.displaced(number, displacement)
        return float(log_effect @ softmax(log_base + persons.sum(axis=1)))

    plain = middle(likelihoods.changing[EFFECT][:, of_study], 0.0)
    assert middle(moved, 0.0) > plain + 0.03
    assert middle(likelihoods.changing[EFFECT][:, of_study], by) == pytest.approx(
        middle(moved, 0.0), abs=0.006
    )


def test_luck_of_responses_and_of_recordings_is_taken_off_pairs() -> None:
    """Middle answers of many banks scatter less about the effect, which they have."""
    found = []
    for seed in range(25):
        own = chance_of(
            plan_case.bank(PERSONS, PAIRED, 100 + seed, 40), PAIRED, plan_case.EFFECT, plan_case.BY
        )
        surplus = float(np.average(own.treated + own.response, weights=own.weight))
        found.append((surplus, surplus + own.displacement(np.arange(PERSONS))))
    before, after = np.std(found, axis=0)
    assert after < 0.6 * before
    assert np.abs(np.mean(found, axis=0)[1]) < 0.01


def test_of_groups_luck_of_responses_is_taken_off() -> None:
    own = plan_case.bank(PERSONS, GROUPS, 5, 60)
    found = chance_of(own, GROUPS, plan_case.EFFECT, plan_case.BY)
    assert found.untreated is None  # both groups are drawn from the bank, whose own level cancels
    response = np.log(own.truth[1] / own.truth[0])[:, plan_case.EFFECT.number]
    moved = replace(found, weight=np.ones(PERSONS)).displacement(np.arange(PERSONS))
    assert moved == pytest.approx(log_factor(plan_case.EFFECT) - response.mean())


def test_a_bank_of_few_persons_makes_the_error_larger(bank: Bank) -> None:
    def error(persons: int) -> float:
        part = replace(
            bank,
            **{name: getattr(bank, name)[:, :persons] for name in BY_ARM},
            number=bank.number[:persons],
            redrawn=bank.redrawn[:persons],
        )
        found = evaluate_bank(part, PAIRED, plan_case.STUDIES, plan_case.BY, 1)
        own = chance_of(part, PAIRED, plan_case.EFFECT, plan_case.BY)
        return float(power_curve(found, own, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1).power_se.mean())

    assert error(6) > error(PERSONS)


@pytest.mark.parametrize(
    ("found", "needed"),
    [([0.2, 0.5, 0.85, 1.0], 15), ([0.9, 0.95, 1.0, 1.0], 4), ([0.1, 0.2, 0.3, 0.7], None)],
)
def test_the_number_of_persons_is_where_power_crosses(found: list[float], needed: int | None) -> None:
    assert persons_for(0.8, [4, 9, 16, 25], np.array(found)) == needed


def test_the_answer_says_what_is_needed_and_what_it_assumes(
    likelihoods: Likelihoods, chance: Chance, bank: Bank
) -> None:
    curve = power_curve(likelihoods, chance, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1)
    own = one_person_power(bank, plan_case.EFFECT, 0.95)
    planned = Plan(plan_case.EFFECT, PAIRED, 0.8, 0.03, 16, (curve,), {3: own}, shipped().plan, (0.1, 0.95))
    lines = plan_lines(planned)
    said = "\n".join(lines)
    assert lines[0].startswith("k_SR -12 %, paired")
    assert f"{curve.needed[0]} persons, each recorded twice" in said
    assert "16 persons, each recorded twice: power" in said
    assert "one person: a change beyond 10% is called" in said
    assert "This assumes:" in said
    table = plan_table(planned)
    assert list(table["persons"]) == list(plan_case.STUDIES.sizes)
    assert (table["effect"] == "k_sr_per_s=-0.12").all()
    assert len(draw_plan(planned).axes) == 1
    none = replace(planned, curves=(replace(curve, needed=(None, None, None)),))
    assert "is not reached by 32 persons" in "\n".join(plan_lines(none))


def test_of_persons_who_came_once_no_change_is_told() -> None:
    assert one_person_power(plan_case.bank(4, GROUPS, 3), plan_case.EFFECT, 0.95) is None
    assert ARMS == (NONE, EFFECT)


def fresh_studies(likelihoods: Likelihoods, persons: FloatArray, size: int) -> FloatArray:
    """Return probability of the effect's direction, and level of its truth, of fresh studies; shape (2, s).

    Args:
        likelihoods: Of a bank, for its hyperdraws.
        persons: Likelihoods of others there, (m, N), each of whom is in one study at most.
        size: Of a study.
    """
    log_effect, log_base = likelihoods.displaced(plan_case.EFFECT.number, 0.0)
    studies = persons[:, : persons.shape[1] // size * size].reshape(len(persons), -1, size).sum(axis=2)
    weight = softmax(log_base[:, None] + studies, axis=0)
    return np.stack([(log_effect < limit) @ weight for limit in (0.0, log_factor(plan_case.EFFECT))])


FRESH_SETTINGS = plan_case.STUDIES.model_copy(
    update={
        "sizes": (8, 11, 14, 17, 20, 24, 28),
        "hyperdraws": 800,
        "recycled_draws": 200,
        "studies": 600,
    }
)


def planned_alone(seeds: Iterable[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Plan with each of some banks alone, and make fresh studies of the sizes that are planned.

    Returns:
        Power that is reached, and coverage; power where the banks are taken as they are, with chance.
    """
    settings = FRESH_SETTINGS
    number, planned, as_it_is = shipped().plan.persons.number, [], []
    for seed in seeds:
        own = plan_case.bank(number, PAIRED, seed, settings.recycled_draws)
        evaluated = evaluate_bank(own, PAIRED, settings, plan_case.BY, seed)
        chance = chance_of(own, PAIRED, plan_case.EFFECT, plan_case.BY)
        untouched = replace(chance, response=0.0 * chance.response, untreated=None)
        for each, sizes in ((chance, planned), (untouched, as_it_is)):
            curve = power_curve(evaluated, each, plan_case.EFFECT, 3, settings, RULE, seed)
            sizes.append(curve.needed[0] or settings.sizes[-1])
    draws = plan_case.fresh_draws(FRESH, 9, settings.recycled_draws)
    persons = plan_case.by_person(draws, evaluated)

    def reached(sizes: list[int]) -> tuple[FloatArray, FloatArray]:
        found = [fresh_studies(evaluated, persons, size) for size in sizes]
        power = [(probability > RULE[0]).mean() for probability, _ in found]
        covered = [((level > 0.05) & (level < 0.95)).mean() for _, level in found]
        print(sizes, np.round(power, 3), np.round(covered, 3))
        return np.array(power), np.array(covered)

    return *reached(planned), reached(as_it_is)[0]


@pytest.mark.exhaustive
def test_fresh_studies_of_the_planned_size_have_the_power_whatever_the_bank() -> None:
    """Of six banks, each planned with alone; as they are, chance moves the power that is reached."""
    power, covered, as_it_is = planned_alone(range(1, 7))
    assert power.mean() == pytest.approx(RULE[1], abs=0.06)
    assert np.abs(power - RULE[1]).max() < 0.12
    assert 0.85 < covered.mean() < 0.95
    assert as_it_is.std() > 1.3 * power.std()


@pytest.mark.slow(minutes=0.5)
def test_banks_of_much_luck_plan_the_right_size_but_not_as_they_are() -> None:
    """Chance variation of one bank asks for too many persons, and that of the other for too few."""
    power, covered, as_it_is = planned_alone([1, 2])
    assert np.abs(power - RULE[1]).max() < 0.12
    assert 0.85 < covered.mean() < 0.95
    assert as_it_is.min() < RULE[1] - 0.12
    assert as_it_is.max() > RULE[1] + 0.12
