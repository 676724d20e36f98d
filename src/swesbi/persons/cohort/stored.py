"""The posterior of a population and of its members, as it is stored: in ArviZ's layout, read without arviz.

A population is one of hearts, whose members are subjects with theta, or one of changes, whose members are
persons with the ratio of theta at two visits. ``cohort_posterior.h5`` has the one, ``changes_groups.h5`` the
other. Their tables, a row a hyperparameter, or a row a member and parameter, differ in the names of rows and
columns alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import Artefact, Group, Labels, Part, Variable, to_groups
from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import AGE, HEART_RATE, SEX
from swesbi.recording.cohort.visits import EVERYONE

NOTE_SEPARATOR: Final = " | "
AS_UNIT: Final = "as unit says"
PER: Final = {AGE: "per 10 years", SEX: "male over female", HEART_RATE: "per 10 beats per minute"}
COLUMNS: Final = ("quantity", "of", "parameter", "median", "low", "high", "unit", "probability_above_1")
SUBJECT_COLUMNS: Final = (
    "subject", "verdict", "group", "parameter", "alone_median", "alone_low", "alone_high", "median", "low",
    "high", "width_ratio", "effective_draws", "refreshed", "outlier_probability",
)  # fmt: skip
CHANGE_COLUMNS: Final = (
    "quantity", "of", "persons", "parameter", "median_1", "low_1", "high_1", "probability_above_1",
)  # fmt: skip
PERSON_COLUMNS: Final = (
    "person", "verdict", "group", "parameter", "alone_median_1", "alone_low_1", "alone_high_1", "median_1",
    "low_1", "high_1", "effective_draws", "outlier_probability",
)  # fmt: skip
MEDIAN, SPREAD, FACTOR, GROUP_MEDIAN, GROUP_FACTOR = (
    "population median", "spread between subjects", "factor", "median of the group", "factor of the group",
)  # fmt: skip
RATIO, RATIO_SPREAD, DIFFERENCE = "mean ratio", "spread between persons", "ratio of groups"
LIMITS: Final = ("low", "median", "high")


@dataclass(frozen=True)
class Population:
    """Draws of what the population is like; the first axis is ArviZ's only chain.

    Factors of covariates are per ten years, male over female, per ten beats per minute; those of groups
    are against the reference group.
    """

    median: Annotated[
        FloatArray,
        Variable(
            "chain draw parameter", AS_UNIT, "median, of the reference group, at the mean of the covariates"
        ),
    ]
    spread: Annotated[
        FloatArray,
        Variable("chain draw parameter", "1", "standard deviation of the logarithm between members"),
    ]
    covariate_factor: Annotated[
        FloatArray,
        Variable("chain draw covariate parameter", "1", "factor of a parameter per covariate step"),
    ]
    group_factor: Annotated[
        FloatArray, Variable("chain draw compared_group parameter", "1", "factor against the reference group")
    ]
    within: Annotated[
        FloatArray, Variable("chain draw member parameter", AS_UNIT, "each member within the population")
    ]


@dataclass(frozen=True)
class Members:
    """The members before and after the population is taken into account."""

    before: Annotated[
        FloatArray,
        Variable("member limit parameter", AS_UNIT, "lower limit, median, upper limit of each alone"),
    ]
    after: Annotated[
        FloatArray, Variable("member limit parameter", AS_UNIT, "the same within the population")
    ]
    effective_draws: Annotated[
        FloatArray,
        Variable("member", "1", "effective number of recycled draws, averaged over the population"),
    ]
    refreshed: Annotated[NDArray[np.int_], Variable("member", "1", "how often drawn anew")]
    outlier_prior: Annotated[
        FloatArray, Variable("member", "1", "prior probability, by verdict, to be none of the population")
    ]
    outlier_posterior: Annotated[
        FloatArray, Variable("member", "1", "posterior probability to be none of the population")
    ]


@dataclass(frozen=True)
class CohortPosterior(Artefact, kind="cohort_posterior"):
    """What is stored of the posterior of a population of d members; groups may be empty."""

    member: Annotated[tuple[str, ...], Labels("member")]
    verdict: Annotated[tuple[str, ...], Labels("member", "verdict")]
    group: Annotated[tuple[str, ...], Labels("member", "group")]
    unit: Annotated[tuple[str, ...], Labels("parameter", "unit")]
    covariate: Annotated[tuple[str, ...], Labels("covariate")]
    compared_group: Annotated[tuple[str, ...], Labels("compared_group")]
    hyperparameter: Annotated[tuple[str, ...], Labels("hyperparameter")]
    reference_group: Annotated[str, Variable("", "1", "group that the others are compared with; or empty")]
    interval_mass: Annotated[float, Variable("", "1", "mass of the credible intervals")]
    sampler: Annotated[str, Variable("", "1", "what gave the draws: importance or mcmc")]
    reasons: Annotated[str, Variable("", "1", "why the weights were not used, what the sampler missed")]
    converged: Annotated[bool, Variable("", "1", "1 where weights or sampler are reliable, else 0")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    effective_draws: Annotated[
        FloatArray, Variable("hyperparameter", "1", "effective number behind the draws")
    ]
    notes: Annotated[str, Variable("", "1", "what and who was left out, and why; or empty")]
    hyperprior: Annotated[
        FloatArray,
        Variable("hyperparameter law", "unit of the hyperparameter", "centre, log sd, lower, upper bound"),
    ]
    log_posterior: Annotated[
        FloatArray,
        Variable("chain draw", "1", "log density, not normalised, of the logit", "lp", "sample_stats"),
    ]
    design: Annotated[
        FloatArray, Variable("member term", "1", "centred covariates and groups", group="constant_data")
    ]
    covariate_centre: Annotated[
        FloatArray,
        Variable(
            "covariate", "years, 1, 1/min", "mean, men counting 1/2 and women -1/2", group="constant_data"
        ),
    ]
    population: Annotated[Population, Part(group="posterior")]
    members: Annotated[Members, Part(group="members")]
    log_likelihood: Annotated[
        FloatArray,
        Variable(
            "chain draw member", "1", "log evidence ratio of each recording", "recording", "log_likelihood"
        ),
    ]

    labels = {
        "parameter": list(THETA_NAMES),
        "limit": ["lower", "median", "upper"],
        "law": ["centre", "log_sd", "low", "high"],
    }

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups that are compared, the reference first; empty where none are."""
        return (self.reference_group, *self.compared_group) if self.compared_group else ()

    def median_of(self, group: int) -> FloatArray:
        """Return draws (m, 3) of the median of a group, by its place in ``groups``; of everyone: 0."""
        median = self.population.median[0]
        return median if group == 0 else np.asarray(median * self.population.group_factor[0, :, group - 1])

    def to_groups(self) -> dict[str, Group]:
        """Return the groups of the file, with ArviZ's numbers of the only chain and of the draws."""
        return to_groups(self, {**self.labels, "chain": [0], "draw": np.arange(self.log_posterior.shape[1])})


def hyperparameter_table(stored: CohortPosterior) -> pd.DataFrame:
    """Return ``cohort_posterior.csv``: median and interval of each hyperparameter.

    Of factors the probability to be above 1 is given. Where groups are compared, the median of each of them
    and its factor against the reference follow.
    """
    names = {
        "everyone": MEDIAN, "spread": SPREAD, "covariates": FACTOR, "groups": GROUP_MEDIAN,
        "factors": GROUP_FACTOR,
    }  # fmt: skip
    return _table(stored, names, (FACTOR, GROUP_FACTOR))[list(COLUMNS)]


def change_table(stored: CohortPosterior) -> pd.DataFrame:
    """Return ``changes_groups.csv``: the mean ratio of each group, the spread, and each ratio of groups."""
    means = "groups" if stored.groups else "everyone"
    table = _table(stored, {means: RATIO, "spread": RATIO_SPREAD, "factors": DIFFERENCE}, (RATIO, DIFFERENCE))
    return table.rename(columns={name: f"{name}_1" for name in LIMITS})[list(CHANGE_COLUMNS)]


def _table(stored: CohortPosterior, names: Mapping[str, str], factors: Sequence[str]) -> pd.DataFrame:
    """Return rows by parameter, then in the order of ``names``: quantities, by what rows are of.

    The probability to be above 1 is told of ``factors`` alone.
    """
    of_each = [_rows(stored, j) for j in range(len(THETA_NAMES))]
    table = pd.DataFrame(
        [row | {"quantity": name} for of in of_each for kind, name in names.items() for row in of[kind]]
    )
    known = table["quantity"].isin(factors)
    return table.assign(probability_above_1=table["probability_above_1"].where(known))


def _rows(stored: CohortPosterior, j: int) -> dict[str, list[dict[str, Any]]]:
    """Return rows of one parameter, by what they are of; of groups none where these are not compared."""
    population, reference = stored.population, stored.reference_group

    def row(of: str, draws: FloatArray, unit: str, groups: tuple[str, ...] = ()) -> dict[str, Any]:
        low, median, high = median_and_interval(draws[:, j], stored.interval_mass)
        return {
            "of": of,
            "persons": sum(group in groups for group in stored.group) if groups else len(stored.member),
            "parameter": THETA_NAMES[j],
            "median": median,
            "low": low,
            "high": high,
            "unit": unit,
            "probability_above_1": float((draws[:, j] > 1.0).mean()),
        }

    return {
        "everyone": [row(EVERYONE, stored.median_of(0), stored.unit[j])],
        "spread": [row(EVERYONE, population.spread[0], "1")],
        "covariates": [
            row(f"{name}, {PER[name]}", population.covariate_factor[0, :, number], "1")
            for number, name in enumerate(stored.covariate)
        ],
        "groups": [
            row(name, stored.median_of(number), stored.unit[j], (name,))
            for number, name in enumerate(stored.groups)
        ],
        "factors": [
            row(f"{name} over {reference}", population.group_factor[0, :, number], "1", (name, reference))
            for number, name in enumerate(stored.compared_group)
        ],
    }


def subject_table(stored: CohortPosterior) -> pd.DataFrame:
    """Return ``cohort_subjects.csv``: a row a subject and parameter, alone and within the population."""
    return pd.DataFrame(_of_members(stored))[list(SUBJECT_COLUMNS)]


def person_table(stored: CohortPosterior) -> pd.DataFrame:
    """Return ``changes_persons.csv``: a row a person and parameter, the ratio alone and within."""
    named = {f"{prefix}{name}": f"{prefix}{name}_1" for prefix in ("alone_", "") for name in LIMITS}
    table = pd.DataFrame(_of_members(stored)).rename(columns={"subject": "person", **named})
    return table[list(PERSON_COLUMNS)]


def _of_members(stored: CohortPosterior) -> Iterator[dict[str, Any]]:
    members = stored.members
    for d, name in enumerate(stored.member):
        for j, parameter in enumerate(THETA_NAMES):
            before, after = members.before[d, :, j], members.after[d, :, j]
            yield {
                "subject": name,
                "verdict": stored.verdict[d],
                "group": stored.group[d],
                "parameter": parameter,
                **{f"alone_{limit}": float(before[i]) for i, limit in enumerate(LIMITS)},
                **{limit: float(after[i]) for i, limit in enumerate(LIMITS)},
                "width_ratio": _width(after) / _width(before),
                "effective_draws": members.effective_draws[d],
                "refreshed": int(members.refreshed[d]),
                "outlier_probability": members.outlier_posterior[d],
            }


def _width(limits: FloatArray) -> float:
    """Return the log of upper over lower limit."""
    return float(np.log(limits[2] / limits[0]))
