"""``changes_groups.h5``: what has changed in groups, and in each person within them, in ArviZ's layout."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd

from swesbi.artefacts import Labels, Part, Variable
from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA_NAMES
from swesbi.persons.change.groups import infer_change_groups, lacking_draws, member_of_change, unlike_pairs
from swesbi.persons.change.settings import ChangeGroupsSettings
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.infer import CohortResult
from swesbi.persons.cohort.result import StoredPopulation
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.persons.cohort.stored import drawn_within, of_any_population, of_members
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation

RATIO, SPREAD, DIFFERENCE = "mean ratio", "spread between persons", "ratio of groups"
EVERYONE: Final = "all"
COLUMNS: Final = (
    "quantity", "of", "persons", "parameter", "median_1", "low_1", "high_1", "probability_above_1",
)  # fmt: skip
PERSON_COLUMNS: Final = (
    "person", "verdict", "group", "parameter", "alone_median_1", "alone_low_1", "alone_high_1", "median_1",
    "low_1", "high_1", "effective_draws", "outlier_probability",
)  # fmt: skip


@dataclass(frozen=True)
class GroupDraws:
    """Draws of what has changed in the population; the first axis is ArviZ's only chain."""

    ratio: Annotated[
        FloatArray,
        Variable(
            "chain draw parameter",
            "1",
            "later over earlier, geometric mean of all persons or of the first group",
        ),
    ]
    spread: Annotated[
        FloatArray,
        Variable("chain draw parameter", "1", "standard deviation of the log ratio between persons"),
    ]
    group_factor: Annotated[
        FloatArray,
        Variable("chain draw compared_group parameter", "1", "a group's ratio over that of the first group"),
    ]
    person_ratio: Annotated[
        FloatArray,
        Variable("chain draw person parameter", "1", "ratio of each person within the population"),
    ]


@dataclass(frozen=True)
class PersonRatios:
    """The persons before and after the population is taken into account."""

    before: Annotated[
        FloatArray,
        Variable("person limit parameter", "1", "lower limit, median, upper limit of each ratio alone"),
    ]
    after: Annotated[FloatArray, Variable("person limit parameter", "1", "the same within the population")]
    effective_draws: Annotated[
        FloatArray,
        Variable("person", "1", "effective number of recycled draws, averaged over the population"),
    ]
    outlier_prior: Annotated[
        FloatArray, Variable("person", "1", "prior probability, by verdict, to be none of the population")
    ]
    outlier_posterior: Annotated[
        FloatArray, Variable("person", "1", "posterior probability to be none of the population")
    ]


@dataclass(frozen=True)
class ChangeGroups(StoredPopulation, kind="change_groups"):
    """What has changed in groups, as it is stored.

    Attributes:
        person: Names of the d persons, with the verdicts on their pairs and their groups, which may be empty.
        notes: Who is left out and why, what is not compared, whose draws are few: a sentence each, joined.
    """

    person: Annotated[tuple[str, ...], Labels("person")]
    verdict: Annotated[tuple[str, ...], Labels("person", "verdict")]
    group: Annotated[tuple[str, ...], Labels("person", "group")]
    notes: Annotated[str, Variable("", "1", "who and what was left out, and why; or empty")]
    hyperprior: Annotated[
        FloatArray, Variable("hyperparameter law", "1", "centre, log sd, lower, upper bound")
    ]
    population: Annotated[GroupDraws, Part(group="posterior")]
    persons: Annotated[PersonRatios, Part(group="persons")]
    log_likelihood: Annotated[
        FloatArray,
        Variable(
            "chain draw person",
            "1",
            "log evidence ratio of each pair of recordings",
            "recording",
            "log_likelihood",
        ),
    ]

    def ratio_of(self, group: int) -> FloatArray:
        """Return draws (m, 3) of the mean ratio of a group; of all persons (0) where none are compared."""
        ratio = self.population.ratio[0]
        return ratio if group == 0 else np.asarray(ratio * self.population.group_factor[0, :, group - 1])


def change_in_groups(
    changes: Sequence[StoredChange],
    observations: Sequence[Observation],
    *,
    prior: PriorSettings,
    change_groups: ChangeGroupsSettings,
    cohort_posterior: HierarchySettings,
    groups: dict[str, str],
    left_out: tuple[str, ...],
    seed: int,
) -> ChangeGroups:
    """Infer mean and spread of what has changed in the persons with two visits, and how their groups differ.

    Args:
        changes: Of each person.
        observations: Observed curve of each person's earlier visit, in the same order.
        prior: Of theta.
        change_groups: Hyperprior, and how many draws are recycled.
        cohort_posterior: Sizes of the inference.
        groups: Of the persons who have one, by name.
        left_out: What is to be said of those who are left out.
        seed: Of everything.

    Raises:
        ValueError: There is nobody.
    """
    members = [
        member_of_change(
            change,
            replace(observation.context, subject=change.person),
            groups.get(change.person, ""),
            change_groups,
            cohort_posterior.exact.interval,
            seed,
        )
        for change, observation in zip(changes, observations, strict=True)
    ]
    inferred = infer_change_groups(members, prior, change_groups, cohort_posterior, seed)
    few = lacking_draws(inferred, change_groups.least_effective)
    return stored_groups(inferred, (*left_out, *unlike_pairs(changes), *few))


def stored_groups(inferred: CohortResult, notes: Sequence[str]) -> ChangeGroups:
    """Return what is stored of the change in groups; ``notes`` are put before those of its design."""
    rows = in_rows(inferred.eta)[None]
    return ChangeGroups(
        **of_any_population(inferred, notes),
        person=tuple(member.subject for member in inferred.members),
        population=GroupDraws(rows[:, :, 0], rows[:, :, 1], rows[:, :, 2:], drawn_within(inferred)[None]),
        persons=PersonRatios(**of_members(inferred)),
        log_likelihood=inferred.shrinkage.log_likelihood[None],
    )


def change_groups_table(stored: ChangeGroups) -> pd.DataFrame:
    """Return a row for the mean ratio of each group, the spread and each ratio of groups, by parameter."""
    return pd.DataFrame(_rows(stored), columns=list(COLUMNS))


def _rows(stored: ChangeGroups) -> Iterator[dict[str, Any]]:
    names, population = stored.groups or (EVERYONE,), stored.population
    for j, parameter in enumerate(THETA_NAMES):
        for number, name in enumerate(names):
            persons = sum(name in (EVERYONE, group) for group in stored.group)
            yield _row(stored, (RATIO, name, parameter), stored.ratio_of(number)[:, j], persons)
        yield _row(stored, (SPREAD, EVERYONE, parameter), population.spread[0, :, j], len(stored.person))
        for number, name in enumerate(stored.compared_group):
            draws = population.group_factor[0, :, number, j]
            of = (DIFFERENCE, f"{name} over {stored.first_group}", parameter)
            yield _row(stored, of, draws, sum(group in (name, stored.first_group) for group in stored.group))


def _row(stored: ChangeGroups, of: tuple[str, str, str], draws: FloatArray, persons: int) -> dict[str, Any]:
    low, median, high = median_and_interval(draws, stored.interval_mass)
    quantity, name, parameter = of
    row = {"quantity": quantity, "of": name, "persons": persons, "parameter": parameter}
    row |= {"median_1": median, "low_1": low, "high_1": high}
    return row if quantity == SPREAD else row | {"probability_above_1": float((draws > 1.0).mean())}


def change_persons_table(stored: ChangeGroups) -> pd.DataFrame:
    """Return a row a person and parameter: the ratio alone, and within the population."""
    persons = stored.persons
    rows = [
        {
            "person": name,
            "verdict": stored.verdict[d],
            "group": stored.group[d],
            "parameter": parameter,
            **_limits("alone_", persons.before[d, :, j]),
            **_limits("", persons.after[d, :, j]),
            "effective_draws": persons.effective_draws[d],
            "outlier_probability": persons.outlier_posterior[d],
        }
        for d, name in enumerate(stored.person)
        for j, parameter in enumerate(THETA_NAMES)
    ]
    return pd.DataFrame(rows, columns=list(PERSON_COLUMNS))


def _limits(prefix: str, limits: FloatArray) -> dict[str, float]:
    return {f"{prefix}{name}_1": float(limits[i]) for i, name in enumerate(("low", "median", "high"))}
