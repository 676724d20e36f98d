from __future__ import annotations

from dataclasses import replace

import hierarchy_case as case
import numpy as np
import pytest

from swesbi.persons.cohort.cohort import Design, Member, design_of, make_member
from swesbi.persons.cohort.infer import VisitSettings, first_visits


def members(groups: str, sexes: str = "FM") -> list[Member]:
    return case.blank(case.contexts(len(groups), np.random.default_rng(2), sexes), groups)


def test_covariates_are_centred_and_counted_in_steps() -> None:
    cohort = members("    ")
    design = design_of(cohort)
    assert design.covariates == ("age", "sex", "heart_rate")
    assert design.matrix.mean(axis=0) == pytest.approx(0.0, abs=1e-12)
    years = [member.context.age_years for member in cohort]
    beats = [member.context.hr_bpm for member in cohort]
    assert np.ptp(design.matrix, axis=0) == pytest.approx([np.ptp(years) / 10.0, 1.0, np.ptp(beats) / 10.0])
    assert design.matrix[1, 1] == pytest.approx(0.5)  # a man
    assert design.centres == pytest.approx([np.mean(years), 0.0, np.mean(beats)])


def test_what_does_not_vary_is_left_out_and_named() -> None:
    design = design_of(members("   ", sexes="M"))
    assert design.covariates == ("age", "heart_rate")
    assert design.notes == ("sex does not vary over the cohort: no slope on it is inferred",)
    assert design_of(members(" ")).matrix.shape == (1, 0)


def of_group(design: Design) -> tuple[tuple[str, ...], list[float]]:
    return design.groups, design.matrix[:, -1].tolist()


def test_groups_are_compared_with_the_first_or_the_one_that_is_named() -> None:
    cohort = members("babab")
    assert of_group(design_of(cohort)) == (("b", "a"), [0.0, 1.0, 0.0, 1.0, 0.0])
    assert of_group(design_of(cohort, reference="a")) == (("a", "b"), [1.0, 0.0, 1.0, 0.0, 1.0])
    assert case.hyperprior(design_of(cohort)).names[-1] == "a factor k_sr_per_s"
    with pytest.raises(ValueError, match="reference group 'c': no person is of it; the groups are b, a"):
        design_of(cohort, reference="c")


@pytest.mark.parametrize(
    ("groups", "said"), [("aaab", "the group 'b' has one person"), ("aab ", "s3 has none")]
)
def test_groups_that_cannot_be_compared_are_one_population(groups: str, said: str) -> None:
    design = design_of(members(groups))
    assert design.groups == ()
    assert design.matrix.shape == (4, 3)
    assert any(said in note for note in design.notes)


def test_a_person_counts_once_with_the_first_visit() -> None:
    visits = {name: VisitSettings(person=name[0], group="a") for name in ("P1", "Q1", "P2")}
    first, (note,) = first_visits(["P1", "Q1", "P2", "R"], visits)
    assert first == ("P1", "Q1", "R")
    assert note.endswith("left out as later visits: P2")
    assert first_visits(["P1", "Q1"], {}) == (("P1", "Q1"), ())


def test_recycled_draws_follow_the_weights_and_nobody_else() -> None:
    rng = np.random.default_rng(1)
    context = case.contexts(1, rng)[0]
    theta = np.exp(rng.normal([3.8, 1.6, 3.4], 0.2, (4000, 3)))
    weight = (theta[:, 0] / 45.0) ** 5  # so that the weighted mean of k_0 is a fifth higher
    weight /= weight.sum()
    one, again, other = (
        make_member(replace(context, subject=name), status, "", (theta, weight), (1000, 0.9), 7)
        for name, status in (("s0", "not contradicted"), ("s0", "doubtful"), ("other", "not contradicted"))
    )
    assert np.array_equal(one.theta, again.theta)
    assert not np.array_equal(one.theta, other.theta)
    assert one.theta.mean(axis=0) == pytest.approx(weight @ theta, rel=0.02)
    assert weight @ theta[:, 0] > 1.15 * theta[:, 0].mean()
    assert one.alone == pytest.approx(np.quantile(one.theta, [0.05, 0.5, 0.95], axis=0), rel=0.05)


def test_an_empty_cohort_is_refused() -> None:
    with pytest.raises(ValueError, match="a population needs at least one person"):
        case.infer([], case.SETTINGS, None, 1)
