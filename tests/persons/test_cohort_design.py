"""What a cohort is taken to depend on, and what is said where it cannot tell."""

from __future__ import annotations

from dataclasses import replace

import hierarchy_case as case
import numpy as np
import pytest

from swesbi.persons.cohort.cohort import Member, design_of, make_member, weighted_quantiles
from swesbi.persons.cohort.hyperprior import hyperprior_of
from swesbi.persons.cohort.posterior import VisitSettings, first_visits

NONE = np.empty((0, 3))


def members(groups: str, sexes: str = "FM") -> list[Member]:
    contexts = case.contexts(len(groups), np.random.default_rng(2), sexes)
    return [
        Member(context, "not contradicted", group.strip(), NONE, NONE)
        for context, group in zip(contexts, groups, strict=True)
    ]


def test_covariates_are_centred_and_counted_in_steps() -> None:
    cohort = members("    ")
    design = design_of(cohort)
    assert design.covariates == ("age", "sex", "heart_rate")
    assert design.matrix.mean(axis=0) == pytest.approx(0.0, abs=1e-12)
    years = [member.context.age_years for member in cohort]
    assert np.ptp(design.matrix[:, 0]) == pytest.approx(np.ptp(years) / 10.0)
    assert set(np.round(design.matrix[:, 1], 12)) == {-0.5, 0.5}
    assert design.centres == pytest.approx(
        [np.mean(years), 0.0, np.mean([member.context.hr_bpm for member in cohort])]
    )


def test_what_does_not_vary_is_left_out_and_named() -> None:
    design = design_of(members("   ", sexes="M"))
    assert design.covariates == ("age", "heart_rate")
    assert design.notes == ("sex does not vary over the cohort: no slope on it is inferred",)
    alone = design_of(members(" "))
    assert alone.covariates == ()
    assert alone.matrix.shape == (1, 0)


def test_groups_are_compared_with_the_first() -> None:
    design = design_of(members("babab"))
    assert design.groups == ("b", "a")
    assert design.matrix[:, -1].tolist() == [0.0, 1.0, 0.0, 1.0, 0.0]
    names = hyperprior_of(design, case.THETA_PRIOR.parameters, case.HYPERPRIOR).names
    assert len(names) == 3 * (2 + 3 + 1)
    assert names[-1] == "a factor k_sr_per_s"


def test_the_reference_group_is_the_one_that_is_named() -> None:
    design = design_of(members("babab"), reference="a")
    assert design.groups == ("a", "b")
    assert design.matrix[:, -1].tolist() == [1.0, 0.0, 1.0, 0.0, 1.0]
    with pytest.raises(ValueError, match="reference group 'c': no person is of it; the groups are b, a"):
        design_of(members("babab"), reference="c")


@pytest.mark.parametrize(
    ("groups", "said"),
    [
        ("aaab", "the group 'b' has one person, whose difference from the others says nothing of a group"),
        ("aab ", "groups are not compared: s3 has none; fill the column group of subjects.csv"),
    ],
)
def test_groups_that_cannot_be_compared_are_one_population(groups: str, said: str) -> None:
    design = design_of(members(groups))
    assert design.groups == ()
    assert design.matrix.shape == (4, 3)
    assert any(said in note for note in design.notes)


def test_a_person_counts_once_with_the_first_visit() -> None:
    visits = {
        "s1": VisitSettings(person="P", group="a"),
        "s2": VisitSettings(person="Q", group="a"),
        "s3": VisitSettings(person="P", group="a"),
    }
    first, notes = first_visits(["s1", "s2", "s3", "s4"], visits)
    assert first == ("s1", "s2", "s4")
    assert notes == ("a person counts once, with the first visit; left out as later visits: s3",)
    assert first_visits(["s1", "s2"], {}) == (("s1", "s2"), ())


def test_recycled_draws_follow_the_weights_and_nobody_else() -> None:
    rng = np.random.default_rng(1)
    context = case.contexts(1, rng)[0]
    theta = np.exp(rng.normal([3.8, 1.6, 3.4], 0.2, (4000, 3)))
    weight = (theta[:, 0] / 45.0) ** 5  # so that the weighted mean of k_0 is a fifth higher
    weight /= weight.sum()
    one = make_member(context, "not contradicted", "", (theta, weight), (1000, 0.9), 7)
    again = make_member(context, "doubtful", "b", (theta, weight), (1000, 0.9), 7)
    other = make_member(
        replace(context, subject="other"), "not contradicted", "", (theta, weight), (1000, 0.9), 7
    )
    assert np.array_equal(one.theta, again.theta)
    assert not np.array_equal(one.theta, other.theta)
    assert one.theta.mean(axis=0) == pytest.approx(weight @ theta, rel=0.02)
    assert weight @ theta[:, 0] > 1.15 * theta[:, 0].mean()
    assert one.alone == pytest.approx(np.quantile(one.theta, [0.05, 0.5, 0.95], axis=0), rel=0.05)


def test_quantiles_of_equal_weights_are_those_of_the_draws() -> None:
    values = np.random.default_rng(4).normal(size=(2000, 3))
    levels = np.array([0.05, 0.5, 0.95])
    found = weighted_quantiles(values, np.full(2000, 1.0 / 2000), levels)
    assert found == pytest.approx(np.quantile(values, levels, axis=0), abs=0.01)


def test_an_empty_cohort_and_an_unknown_verdict_are_refused() -> None:
    with pytest.raises(ValueError, match="a population needs at least one person"):
        case.infer([], case.SETTINGS, None, 1)
    with pytest.raises(
        ValueError,
        match="verdict 'odd': expected one of not contradicted, uninformative, doubtful, contradicted",
    ):
        case.OUTLIERS.of("odd")
