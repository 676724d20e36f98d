"""An experiment over a population: coverage by stratum, who is answered and who refused, with what reason."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from pydantic import JsonValue

from swesbi.checks.calibration.ranks import SAMPLERS
from swesbi.population.settings import DECLARED_NAMES, MOST_SHOWN
from swesbi.report.figures.cohort import counted_reasons
from swesbi.report.figures.population import stratum_label
from swesbi.report.numbers import CONTEXT, MISSING, PARAMETERS, count, estimate, fixed, percent, span
from swesbi.report.results import records
from swesbi.report.table import Column, Row, Table, words
from swesbi.report.tables.exact import SYMBOLS, UNITS
from swesbi.verdict.answers import ANSWERS, OUTCOMES, REFUSED
from swesbi.verdict.verdict import CONTRADICTED, STRAINED

SAMPLER_NAMES: Final = {"importance": "importance weights", "mcmc": "MCMC"}


@dataclass(frozen=True)
class OverPopulation:
    """What is shown of one experiment over a population.

    Attributes:
        name: Its name in the configuration.
        settings: Its section of the configuration, plain.
        interval: Mass of the credible intervals.
        cohort: ``cohort.csv``.
        strata: ``strata.csv``.
        pressures: Its rows of ``pressures.csv``; None where no subject has pressures.
    """

    name: str
    settings: Mapping[str, JsonValue]
    interval: float
    cohort: pd.DataFrame
    strata: pd.DataFrame
    pressures: pd.DataFrame | None = None

    @property
    def answered(self) -> pd.DataFrame:
        """The subjects that are not refused."""
        return self.cohort[self.cohort["status"] != REFUSED]

    @property
    def coverage(self) -> pd.DataFrame:
        """Coverage at the level of the credible intervals."""
        return self.strata[np.isclose(self.strata["nominal"], self.interval)]


def strata_table(shown: OverPopulation) -> Table:
    """Return coverage of both answers by stratum, with the efficiency of the weights."""
    columns = (
        *words("Stratum", "Answer"),
        *(Column(f"Coverage of {symbol}", "% (interval)") for symbol in PARAMETERS.values()),
        Column("Recordings"),
        Column("Median efficiency", "%"),
    )
    rows = []
    for stratum in dict.fromkeys(shown.coverage["stratum"]):
        for sampler in SAMPLERS:
            rows.append(_stratum(shown.coverage, str(stratum), sampler))
    level = percent(shown.interval, 0)
    note = (
        f"Nominal: {level} %. Each fresh context is recorded once under the model's own noise; none was "
        "trained on. Intervals: 95 % Clopper-Pearson."
    )
    return Table(
        f"Coverage of {level} % intervals by stratum, on fresh contexts.", columns, tuple(rows), note
    )


def cohort_table(shown: OverPopulation, cohort_title: str) -> Table:
    """Return a row a subject of a small cohort, counts of a large one."""
    small = len(shown.cohort) <= MOST_SHOWN
    return _subjects(shown, cohort_title) if small else counts_table(shown, cohort_title)


def counts_table(shown: OverPopulation, cohort_title: str, most_reasons: int | None = 3) -> Table:
    """Return how many subjects have which verdict, with the commonest reasons, or all where None is given."""
    columns = (
        *words("Verdict", "Commonest reasons"),
        Column("Subjects"),
        Column("Share", "%"),
        Column("Median efficiency", "%"),
    )
    rows = []
    for status in OUTCOMES:
        subjects = shown.cohort[shown.cohort["status"] == status]
        reasons = list(counted_reasons(subjects).items())[:most_reasons]
        cells = (
            status,
            ", ".join(f"{reason} ({number})" for reason, number in reasons) or MISSING,
            count(len(subjects)),
            percent(len(subjects) / len(shown.cohort)),
            percent(float(subjects["efficiency"].median()), 0),
        )
        rows.append(Row(cells))
    note = "Each subject has its row in cohort.csv, with context, reason, medians and limits."
    return Table(f"Verdicts over the cohort ({cohort_title}).", columns, tuple(rows), note)


def range_in_words(settings: Mapping[str, Any]) -> str:
    """Return the declared range: "heart rate 40 to 130 /min, LVEDV 35 to 300 mL, ..."."""
    limits = settings["population"]["declared_range"]
    units = dict(zip(DECLARED_NAMES, ("/min", "mL", "cm"), strict=True))
    parts = [
        f"{CONTEXT[name]} {limits[name][0]:g} to {limits[name][1]:g} {units[name]}" for name in DECLARED_NAMES
    ]
    low, high = limits["relative_thickness"]
    return ", ".join([*parts, f"septal thickness over the radius {low:g} to {high:g}"])


def _stratum(table: pd.DataFrame, stratum: str, sampler: str) -> Row:
    rows = table[(table["stratum"] == stratum) & (table["sampler"] == sampler)]
    by_parameter = {str(row["parameter"]): row for row in records(rows)}
    first = next(iter(by_parameter.values()))
    cells = (
        stratum_label(stratum),
        ANSWERS[sampler],
        *(_covered(by_parameter[name]) for name in PARAMETERS),
        count(first["n"]),
        percent(first["median_efficiency"], 0),
    )
    return Row(cells, summary=stratum == "all")


def _covered(row: Mapping[Hashable, Any]) -> str:
    return f"{percent(row['coverage'])} ({span(percent(row['ci_low']), percent(row['ci_high']))})"


def _subjects(shown: OverPopulation, cohort_title: str) -> Table:
    names = list(SYMBOLS)
    columns = (
        *words("Subject", "Verdict", "What speaks against it"),
        *(Column(SYMBOLS[name], f"{UNITS[name]}, median (interval)") for name in names),
        Column("k-hat"),
        Column("Efficiency", "%"),
        *words("Draws by"),
    )
    rows = []
    for row in records(shown.cohort):
        refused = row["status"] == REFUSED
        answer = [MISSING] * len(names) if refused else [_limits(row, name) for name in names]
        reliability = (
            _shape(row["k_hat"], refused),
            percent(float(row["efficiency"]), 0),
            MISSING if refused else SAMPLER_NAMES[str(row["sampler"])],
        )
        cells = (
            str(row["subject"]),
            str(row["status"]),
            str(row["reason"]) or MISSING,
            *answer,
            *reliability,
        )
        unread = row["status"] in {REFUSED, CONTRADICTED}
        rows.append(Row(cells, muted=unread, strained=row["status"] == STRAINED))
    note = (
        "Who lies outside the declared range is refused: the network has learnt nothing there. Grey: "
        "refused, or contradicted, whose answer is not to be read as that of the subject."
    )
    return Table(f"Every subject as the network answers it ({cohort_title}).", columns, tuple(rows), note)


def _limits(row: Mapping[Hashable, Any], name: str) -> str:
    values = (float(row[f"{name}_{limit}"]) for limit in ("median", "low", "high"))
    return "{} ({})".format(*estimate(*values))


def _shape(value: float, refused: bool) -> str:
    if refused:
        return MISSING
    return fixed(value, 2) if math.isfinite(value) else "inf"
