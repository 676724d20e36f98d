"""The posterior of a population as tables: a row a hyperparameter, a row a member and parameter.

Populations of hearts and of changes differ in the names of rows and columns alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import AGE, HEART_RATE, SEX
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.recording.cohort.visits import EVERYONE

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


class Rows(NamedTuple):
    """Rows of one parameter, by what they are of; of groups none where these are not compared."""

    everyone: dict[str, Any]
    spread: dict[str, Any]
    covariates: list[dict[str, Any]]
    groups: list[dict[str, Any]]
    factors: list[dict[str, Any]]


def hyperparameter_table(stored: CohortPosterior) -> pd.DataFrame:
    """Return ``cohort_posterior.csv``: median and interval of each hyperparameter.

    Of factors the probability to be above 1 is given. Where groups are compared, the median of each of them
    and its factor against the reference follow.
    """
    rows: list[dict[str, Any]] = []
    for j in range(len(THETA_NAMES)):
        of = _rows(stored, j)
        rows += [of.everyone | {"quantity": MEDIAN}, of.spread | {"quantity": SPREAD}]
        rows += [row | {"quantity": FACTOR} for row in of.covariates]
        rows += [row | {"quantity": GROUP_MEDIAN} for row in of.groups]
        rows += [row | {"quantity": GROUP_FACTOR} for row in of.factors]
    table = pd.DataFrame(rows)
    known = table["quantity"].isin([FACTOR, GROUP_FACTOR])
    return table.assign(probability_above_1=table["probability_above_1"].where(known))[list(COLUMNS)]


def change_table(stored: CohortPosterior) -> pd.DataFrame:
    """Return ``changes_groups.csv``: the mean ratio of each group, the spread, and each ratio of groups."""
    rows: list[dict[str, Any]] = []
    for j in range(len(THETA_NAMES)):
        of = _rows(stored, j)
        rows += [row | {"quantity": RATIO} for row in of.groups or [of.everyone]]
        rows += [of.spread | {"quantity": RATIO_SPREAD}]
        rows += [row | {"quantity": DIFFERENCE} for row in of.factors]
    table = pd.DataFrame(rows).rename(columns={name: f"{name}_1" for name in LIMITS})
    known = table["quantity"] != RATIO_SPREAD
    return table.assign(probability_above_1=table["probability_above_1"].where(known))[list(CHANGE_COLUMNS)]


def _rows(stored: CohortPosterior, j: int) -> Rows:
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

    return Rows(
        everyone=row(EVERYONE, stored.median_of(0), stored.unit[j]),
        spread=row(EVERYONE, population.spread[0], "1"),
        covariates=[
            row(f"{name}, {PER[name]}", population.covariate_factor[0, :, number], "1")
            for number, name in enumerate(stored.covariate)
        ],
        groups=[
            row(name, stored.median_of(number), stored.unit[j], (name,))
            for number, name in enumerate(stored.groups)
        ],
        factors=[
            row(f"{name} over {reference}", population.group_factor[0, :, number], "1", (name, reference))
            for number, name in enumerate(stored.compared_group)
        ],
    )


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
