"""Power from a bank, on persons whose posteriors are known in closed form."""

from __future__ import annotations

from dataclasses import replace

import hierarchy_case as case
import numpy as np
import plan_case
import pytest
import ratio_case
from scipy.special import ndtr, ndtri

from swesbi.arrays import FloatArray
from swesbi.change.groups import infer_change_groups
from swesbi.hierarchy.cohort import Member
from swesbi.planning.asked import log_factor
from swesbi.planning.bank import ARMS, BY_ARM, EFFECT, NONE, Bank
from swesbi.planning.hyperdraws import Likelihoods, evaluate_bank, planned_design
from swesbi.planning.individuals import one_person_power
from swesbi.planning.power import draw_counts, judge_studies, persons_for, power_curve
from swesbi.planning.settings import GROUPS, PAIRED
from swesbi.planning.words import Planned, plan_lines, plan_table
from swesbi.show.figures.plan import draw_plan

RULE = (0.95, 0.8)
PERSONS = 40


@pytest.fixture(scope="module")
def bank() -> Bank:
    return plan_case.bank(PERSONS, PAIRED, 1)


@pytest.fixture(scope="module")
def likelihoods(bank: Bank) -> Likelihoods:
    return evaluate_bank(bank, PAIRED, plan_case.STUDIES, plan_case.BY, 1)


def test_a_study_at_common_hyperparameters_is_what_its_own_posterior_says(
    bank: Bank, likelihoods: Likelihoods
) -> None:
    chosen = np.arange(10)
    members = [
        Member(context, "supported", "", draws, draws[:3])
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


def test_power_is_near_that_of_normal_theory(likelihoods: Likelihoods, bank: Bank) -> None:
    curve = power_curve(likelihoods, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1)
    assert (np.diff(curve.power) > -0.1).all()
    draws = np.log(bank.of_arm(EFFECT)[:, :, plan_case.EFFECT.number])
    sd = np.sqrt(plan_case.SPREAD[plan_case.EFFECT.number] ** 2 + draws.var(axis=1).mean())
    theory = ndtr(np.sqrt(curve.sizes) * abs(log_factor(plan_case.EFFECT)) / sd - ndtri(0.95))
    assert np.abs(curve.power - theory)[1:].max() < 0.25
    assert curve.power[-1] > 0.9
    assert curve.false_positive.max() < 0.12
    assert (curve.rough < 0.2).all()
    number, fewest, most = curve.needed
    assert number is not None
    assert fewest is not None
    assert fewest <= number
    assert most is None or most >= number
    assert (curve.power_se > 0.0).any()


def test_two_groups_need_more_persons_than_two_visits(likelihoods: Likelihoods) -> None:
    of_groups = evaluate_bank(plan_case.bank(PERSONS, GROUPS, 2), GROUPS, plan_case.STUDIES, plan_case.BY, 1)
    paired, grouped = (
        power_curve(each, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1)
        for each in (likelihoods, of_groups)
    )
    assert grouped.power[2:].mean() < paired.power[2:].mean()
    assert planned_design(GROUPS, [False, True]).matrix.tolist() == [[0.0], [1.0]]


def test_studies_are_drawn_with_replacement_and_from_resampled_banks() -> None:
    rng = np.random.default_rng(1)
    plain, resampled = (draw_counts(10, 30, 40, resamples, rng) for resamples in (0, 4))
    assert (plain.sum(axis=0) == 30).all()
    assert (resampled.sum(axis=0) == 30).all()
    of_bank = [(resampled[:, start : start + 10].sum(axis=1) > 0).sum() for start in range(0, 40, 10)]
    assert max(of_bank) < 10


def test_a_bank_of_few_persons_makes_the_error_larger(bank: Bank) -> None:
    def error(persons: int) -> float:
        part = replace(
            bank,
            **{name: getattr(bank, name)[:, :persons] for name in BY_ARM},
            number=bank.number[:persons],
            redrawn=bank.redrawn[:persons],
        )
        found = evaluate_bank(part, PAIRED, plan_case.STUDIES, plan_case.BY, 1)
        return float(power_curve(found, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1).power_se.mean())

    assert error(6) > error(PERSONS)


@pytest.mark.parametrize(
    ("found", "needed"),
    [([0.2, 0.5, 0.85, 1.0], 15), ([0.9, 0.95, 1.0, 1.0], 4), ([0.1, 0.2, 0.3, 0.7], None)],
)
def test_the_number_of_persons_is_where_power_crosses(found: list[float], needed: int | None) -> None:
    assert persons_for(0.8, [4, 9, 16, 25], np.array(found)) == needed


def test_the_answer_says_what_is_needed_and_what_it_assumes(likelihoods: Likelihoods, bank: Bank) -> None:
    from speed_case import shipped

    curve = power_curve(likelihoods, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1)
    own = one_person_power(bank, plan_case.EFFECT, 0.95)
    planned = Planned(
        plan_case.EFFECT, PAIRED, 0.8, 0.03, 16, (curve,), {3: own}, shipped().plan, (0.1, 0.95)
    )
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


def fresh_study(persons: int, seed: int) -> FloatArray:
    """Return probability of the effect's direction, and level of its truth, of a study made afresh."""
    rng = np.random.default_rng(seed)
    delta = plan_case.log_ratios(persons, log_factor(plan_case.EFFECT), rng)
    members = ratio_case.members_of(delta, ("",) * persons, seed)
    own = infer_change_groups(members, case.THETA_PRIOR, plan_case.BY.changes, plan_case.BY.cohort, seed)
    effect = np.log(own.exact.phi[:, plan_case.EFFECT.number])
    return np.array([(effect < 0.0).mean(), (effect < log_factor(plan_case.EFFECT)).mean()])


@pytest.mark.slow(minutes=4)
def test_fresh_studies_of_the_planned_size_have_the_power() -> None:
    """Of a bank large enough that its own luck moves power little."""
    large = evaluate_bank(plan_case.bank(4 * PERSONS, PAIRED, 1), PAIRED, plan_case.STUDIES, plan_case.BY, 1)
    number = power_curve(large, plan_case.EFFECT, 3, plan_case.STUDIES, RULE, 1).needed[0]
    assert number is not None
    found = np.array([fresh_study(number, 2000 + seed) for seed in range(60)])
    assert (found[:, 0] > 0.95).mean() == pytest.approx(0.8, abs=0.18)
    assert ((found[:, 1] > 0.05) & (found[:, 1] < 0.95)).mean() > 0.8
