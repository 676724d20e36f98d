"""The posterior of a cohort as the page shows it: sentences, the population, every subject within it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.parameters import THETA
from swesbi.persons.cohort.stored import NOTE_SEPARATOR, CohortPosterior
from swesbi.persons.cohort.table import (
    FACTOR,
    GROUP_FACTOR,
    MEDIAN,
    SPREAD,
    hyperparameter_table,
    subject_table,
)
from swesbi.report.columns import COLUMNS
from swesbi.report.numbers import (
    PARAMETER_UNITS,
    PARAMETERS,
    estimate,
    fixed,
    interval,
    percent,
    with_limits,
)
from swesbi.report.results import columns_of, marked, records, wide
from swesbi.report.table import Column, Table, words
from swesbi.verdict.summary import LIMITS

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
    tables = {
        "population": population_table(population, title),
        "subjects": subjects_table(subjects, title),
    }
    compared = f"Groups are compared with {posterior.reference_group}."
    notes = (f"{note[:1].upper()}{note[1:]}." for note in posterior.notes.split(NOTE_SEPARATOR) if note)
    said = (*in_words(population, subjects), *([compared] if posterior.groups else ()), *notes)
    return CohortSection(said, tables)


def population_table(table: pd.DataFrame, title: str) -> Table:
    """Return a row a hyperparameter, parameter by parameter."""
    columns = (
        COLUMNS["parameter"],
        words(("quantity", "of"), "Quantity", _quantity),
        COLUMNS["median"],
        Column(LIMITS, "Interval", "", interval),
        words(("parameter", "unit"), "Unit", lambda name, unit: PARAMETER_UNITS[name] if unit != "1" else ""),
        Column("probability_above_1", "Above 1", "%", "0%"),
    )
    return Table(f"The population of the {title}.", table, columns, NOTE)


def _quantity(name: str, of: str) -> str:
    return name if of == "all" else f"{name}: {of.replace('_', ' ')}"


def subjects_table(table: pd.DataFrame, title: str) -> Table:
    """Return a row a subject: each parameter alone and within the population."""
    columns = (
        COLUMNS["subject"],
        words("verdict", "Verdict"),
        *(
            Column(
                columns_of(of),
                f"{PARAMETERS[name]} {how}",
                f"{PARAMETER_UNITS[name]} (interval)",
                with_limits,
            )
            for name in PARAMETERS
            for how, of in (("alone", f"{name}_alone"), ("within", name))
        ),
        Column("outlier_probability", "Outlier", "%", "0%"),
        Column(
            ("effective_draws", "refreshed"),
            "Draws",
            "",
            lambda draws, refreshed: f"{draws:.0f}{'*' if refreshed else ''}",
        ),
    )
    frame = wide(table, ["subject"], "parameter")
    caption = f"Every subject alone and within the population ({title})."
    return Table(caption, marked(frame, frame["verdict"]), columns, SUBJECT_NOTE)


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
