"""The posterior of a cohort as tables: a row a hyperparameter, a row a subject and parameter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA
from swesbi.persons.cohort.cohort import AGE, HEART_RATE, SEX
from swesbi.persons.cohort.result import CohortPosterior

PER: Final = {AGE: "per 10 years", SEX: "male over female", HEART_RATE: "per 10 beats per minute"}
COLUMNS: Final = ("quantity", "of", "parameter", "median", "low", "high", "unit", "probability_above_1")
SUBJECT_COLUMNS: Final = (
    "subject", "verdict", "group", "parameter", "alone_median", "alone_low", "alone_high", "median", "low",
    "high", "width_ratio", "effective_draws", "refreshed", "outlier_probability",
)  # fmt: skip
MEDIAN, SPREAD, FACTOR, GROUP_MEDIAN, GROUP_FACTOR = (
    "population median", "spread between subjects", "factor", "median of the group", "factor of the group",
)  # fmt: skip


def hyperparameter_table(posterior: CohortPosterior) -> pd.DataFrame:
    """Return a row a hyperparameter: median and credible interval; of factors the probability to be above 1.

    Where groups are compared, the median of each of them and its factor against the first follow.
    """
    return pd.DataFrame(_rows(posterior), columns=list(COLUMNS))


def _rows(posterior: CohortPosterior) -> Iterator[dict[str, Any]]:
    population, mass = posterior.population, posterior.interval_mass
    for j, parameter in enumerate(THETA):
        named = {"of": "all", "parameter": parameter.name}
        yield named | _row(MEDIAN, population.median[0, :, j], mass, parameter.cf_unit)
        yield named | _row(SPREAD, population.spread[0, :, j], mass, "1")
        for number, name in enumerate(posterior.covariate):
            named["of"] = f"{name}, {PER[name]}"
            yield named | _factor(FACTOR, population.covariate_factor[0, :, number, j], mass)
        for number, name in enumerate(posterior.groups):
            named["of"] = name
            yield named | _row(GROUP_MEDIAN, group_median(posterior, number, j), mass, parameter.cf_unit)
        for number, name in enumerate(posterior.compared_group):
            named["of"] = f"{name} over {posterior.first_group}"
            yield named | _factor(GROUP_FACTOR, population.group_factor[0, :, number, j], mass)


def group_median(posterior: CohortPosterior, group: int, parameter: int) -> FloatArray:
    """Return draws (m,) of a parameter's median in one group, at the cohort's mean covariates."""
    median = posterior.population.median[0, :, parameter]
    if group == 0:
        return median
    return np.asarray(median * posterior.population.group_factor[0, :, group - 1, parameter])


def _row(quantity: str, draws: FloatArray, mass: float, unit: str) -> dict[str, Any]:
    low, median, high = median_and_interval(draws, mass)
    return {"quantity": quantity, "median": median, "low": low, "high": high, "unit": unit}


def _factor(quantity: str, draws: FloatArray, mass: float) -> dict[str, Any]:
    return _row(quantity, draws, mass, "1") | {"probability_above_1": float((draws > 1.0).mean())}


def subject_table(posterior: CohortPosterior) -> pd.DataFrame:
    """Return a row a subject and parameter: alone, and within the population."""
    subjects = posterior.subjects
    rows = [
        {
            "subject": name,
            "verdict": posterior.verdict[d],
            "group": posterior.group[d],
            "parameter": parameter.name,
            **_limits("alone_", subjects.before[d, :, j]),
            **_limits("", subjects.after[d, :, j]),
            "width_ratio": _width(subjects.after[d, :, j]) / _width(subjects.before[d, :, j]),
            "effective_draws": subjects.effective_draws[d],
            "refreshed": int(subjects.refreshed[d]),
            "outlier_probability": subjects.outlier_posterior[d],
        }
        for d, name in enumerate(posterior.subject)
        for j, parameter in enumerate(THETA)
    ]
    return pd.DataFrame(rows, columns=list(SUBJECT_COLUMNS))


def _limits(prefix: str, limits: FloatArray) -> dict[str, float]:
    return {f"{prefix}{name}": float(limits[i]) for i, name in enumerate(("low", "median", "high"))}


def _width(limits: FloatArray) -> float:
    """Return the log of upper over lower limit."""
    return float(np.log(limits[2] / limits[0]))
