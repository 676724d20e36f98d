"""The posterior of a cohort as the page shows it: sentences, the population, every subject within it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.parameters import THETA
from swesbi.persons.cohort.stored import (
    FACTOR,
    GROUP_FACTOR,
    MEDIAN,
    NOTE_SEPARATOR,
    SPREAD,
    CohortPosterior,
    hyperparameter_table,
    subject_table,
)
from swesbi.report.columns import named
from swesbi.report.numbers import PARAMETER_UNITS, PARAMETERS, estimate, fixed, percent
from swesbi.report.results import marked, records, wide
from swesbi.report.table import Table

SURE: Final = 0.95
"""Probability from which a sentence calls a difference one."""
MEANINGS: Final = {parameter.name: f"{parameter.meaning} {parameter.text}" for parameter in THETA}
NOTE: Final = (
    "Median and credible interval. Spread: standard deviation of the logarithm between persons. A factor of "
    "1 is no difference; beside it the probability that it is above 1."
)
SUBJECT_NOTE: Final = (
    "Within the population a subject's answer leans on those of the others, the more the less its own "
    "recording says. Outlier: probability that the subject is none of this population, in which case its own "
    "answer stands. Draws: effective number behind the answer; * drawn anew."
)


@dataclass(frozen=True)
class CohortSection:
    """What the page shows of one experiment's cohort: sentences, and tables by name."""

    sentences: tuple[str, ...]
    tables: Mapping[str, Table]


def cohort_section(posterior: CohortPosterior, title: str) -> CohortSection:
    """Return what is shown of a cohort; what was left out of its posterior is said last."""
    population, subjects = hyperparameter_table(posterior), subject_table(posterior)
    compared = [f"Groups are compared with {posterior.reference_group}."] if posterior.groups else ()
    notes = (f"{note[:1].upper()}{note[1:]}." for note in posterior.notes.split(NOTE_SEPARATOR) if note)
    return CohortSection(
        (*in_words(population, subjects), *compared, *notes),
        {"population": population_table(population, title), "subjects": subjects_table(subjects, title)},
    )


def population_table(table: pd.DataFrame, title: str) -> Table:
    """Return a row a hyperparameter, parameter by parameter."""
    limits = ("median", "hyperparameter_interval", "hyperparameter_unit", "probability_above_1")
    columns = named("parameter", "hyperparameter", *limits)
    return Table(f"The population of the {title}.", table, columns, NOTE)


def subjects_table(table: pd.DataFrame, title: str) -> Table:
    """Return a row a subject: each parameter alone and within the population."""
    both = (f"{how} {name}" for name in PARAMETERS for how in ("alone", "within"))
    frame = wide(table, ["subject"], "parameter")
    return Table(
        f"Every subject alone and within the population ({title}).",
        marked(frame, frame["verdict"]),
        named("subject", "verdict", *both, "outlier_probability", "draws_behind"),
        SUBJECT_NOTE,
    )


def in_words(population: pd.DataFrame, subjects: pd.DataFrame) -> Iterator[str]:
    """Yield what a clinician would ask: how persons differ, with what, and whether groups do."""
    count = subjects["subject"].nunique()
    for name, meaning in MEANINGS.items():
        own = population[population["parameter"] == name]
        median, spread = (records(own[own["quantity"] == each])[0] for each in (MEDIAN, SPREAD))
        middle, interval = estimate(*(float(median[each]) for each in ("median", "low", "high")))
        differ = fixed(float(np.exp(float(spread["median"]))), 2)
        unit = PARAMETER_UNITS[name]
        yield (
            f"The {meaning} of the middle one of such persons is {middle} {unit} ({interval}), "
            f"by {count} of them; two thirds lie within a factor of {differ} of it."
        )
    told = records(population[population["quantity"].isin([FACTOR, GROUP_FACTOR])])
    sure = [row for row in told if not 1.0 - SURE < float(row["probability_above_1"]) < SURE]
    yield from (_difference(row) for row in sure)
    if told and not sure:
        yield "No factor of a covariate or group differs from 1 with a probability above 95 %."


def _difference(row: Mapping[Any, Any]) -> str:
    above = float(row["probability_above_1"])
    factor, interval = estimate(*(float(row[name]) for name in ("median", "low", "high")))
    side, probability = ("higher", above) if above > 0.5 else ("lower", 1.0 - above)
    symbol, of = PARAMETERS[str(row["parameter"])], str(row["of"]).replace("_", " ")
    return (
        f"{symbol}, {of}: {factor} times ({interval}), "
        f"{side} with a probability of {percent(probability, 0)} %."
    )
