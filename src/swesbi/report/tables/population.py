"""An experiment over a population: coverage by stratum, who is answered or refused; what pressures add."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from pydantic import JsonValue

from swesbi.checks.pressures import RESISTANCE
from swesbi.context import CONTEXT
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import PEAK_ACTIVE, PHI_NAMES
from swesbi.population.settings import DECLARED_NAMES, MOST_SHOWN
from swesbi.report.columns import each_parameter, named
from swesbi.report.figures.calibration import stratum_label
from swesbi.report.figures.cohort import counted_reasons
from swesbi.report.numbers import MISSING, fixed, percent, quantity
from swesbi.report.results import marked, wide
from swesbi.report.table import MARK, SUMMARY, Table, words
from swesbi.report.tables.exact import CLOPPER_PEARSON
from swesbi.verdict.summary import OUTCOMES, REFUSED

WITH_PRESSURES: Final = (*PHI_NAMES, PEAK_ACTIVE.name, RESISTANCE, TIME_CONSTANT, CAPACITANCE, VOLUME_FACTOR)
"""Quantities of the table of pressures, in their order; the CSV has all."""
MOST_REASONS: Final = 3
"""The commonest reasons of a verdict that the table of a large cohort names."""


@dataclass(frozen=True)
class PopulationSection:
    """What is shown of one experiment over a population: its tables, by their names.

    Settings are plain, and ``interval`` is the mass of the credible intervals. ``pressures`` is None where
    no subject has pressures.
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


def strata_table(shown: PopulationSection) -> Table:
    """Return coverage of both answers by stratum, with the efficiency of the weights."""
    stratum = words("stratum", "Stratum", stratum_label)
    frame = wide(shown.coverage, ["stratum", "sampler"], "parameter")
    strata = list(frame["stratum"].unique())
    frame = frame.sort_values("stratum", key=lambda names: names.map(strata.index), kind="stable")
    frame[MARK] = frame["stratum"].map({"all": SUMMARY}).fillna("")
    level = percent(shown.interval, 0)
    return Table(
        f"Coverage of {level} % intervals by stratum, on fresh contexts.",
        frame,
        named(stratum, "answer", *each_parameter("coverage"), "n", "median_efficiency"),
        f"Nominal: {level} %. Each fresh context is recorded once under the model's own noise; none was "
        f"trained on. Intervals on coverage: {CLOPPER_PEARSON}.",
    )


def cohort_table(shown: PopulationSection, cohort_title: str) -> Table:
    """Return a row a subject of a small cohort, counts of a large one."""
    table = _subjects if len(shown.cohort) <= MOST_SHOWN else counts_table
    return table(shown, cohort_title)


def counts_table(shown: PopulationSection, cohort_title: str) -> Table:
    """Return how many subjects have which verdict, with the commonest reasons."""
    rows = []
    for status in OUTCOMES:
        subjects = shown.cohort[shown.cohort["status"] == status]
        reasons = list(counted_reasons(subjects).items())[:MOST_REASONS]
        rows.append(
            {
                "status": status,
                "reasons": ", ".join(f"{reason} ({number})" for reason, number in reasons) or MISSING,
                "subjects": len(subjects),
                "share": len(subjects) / len(shown.cohort),
                "median_efficiency": float(subjects["efficiency"].median()),
            }
        )
    return Table(
        f"Verdicts over the cohort ({cohort_title}).",
        pd.DataFrame(rows),
        named("status", "reasons", "subjects", "share", "median_efficiency"),
        "Each subject has its row in cohort.csv, with context, reason, medians and limits.",
    )


def _subjects(shown: PopulationSection, cohort_title: str) -> Table:
    answers = each_parameter("answer", PHI_NAMES)
    return Table(
        f"Every subject as the network answers it ({cohort_title}).",
        marked(shown.cohort, shown.cohort["status"]),
        named("subject", "status", "reason", *answers, "k_hat", "efficiency", "sampler"),
        "Medians and credible intervals. "
        "Who lies outside the declared range is refused: the network has learnt nothing there. Grey: "
        "refused, or contradicted, whose posterior must not be used.",
    )


def range_in_words(settings: Mapping[str, Any]) -> str:
    """Return the declared range: "heart rate 40 to 130 /min, LVEDV 35 to 300 mL, ..."."""
    limits = settings["population"]["declared_range"]
    parts = [
        f"{each.words} {low:g} to {high:g} {each.shown_unit.removeprefix('1')}"
        for each in CONTEXT
        if each.name in DECLARED_NAMES
        for low, high in [limits[each.name]]
    ]
    low, high = limits["relative_thickness"]
    return ", ".join([*parts, f"septal thickness over the radius {low:g} to {high:g}"])


def pressures_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a quantity: widths with over without and shifts, over the subjects."""
    by_quantity = table.groupby("quantity")[["width_ratio", "shift_in_widths"]].agg(_span)
    frame = by_quantity.loc[[name for name in WITH_PRESSURES if name in by_quantity.index]].reset_index()
    return Table(
        f"What pressures add: {table['subject'].nunique()} {cohort_title}.",
        frame,
        named("quantity", "width_ratio", "shift_in_widths"),
        "Over the subjects with cuff pressures. Width: log upper over lower limit of the interval with them, "
        "over that without. Shift: log of the medians' ratio, in widths of the interval without. The "
        "stressed volume is free with pressures alone.",
    )


def _span(values: pd.Series) -> str:
    known = values.dropna()
    if known.empty:
        return MISSING
    low, middle, high = (fixed(float(known.quantile(level)), 2) for level in (0.0, 0.5, 1.0))
    return f"{middle} ({low} to {high})"


def pressures_subjects_table(table: pd.DataFrame, cohort_title: str) -> Table:
    """Return a row a subject: its pressures, what they tell of the circulation, how that was obtained."""
    widths = each_parameter("width", (RESISTANCE, TIME_CONSTANT))
    columns = named("subject", "cuff", *widths, f"with {VOLUME_FACTOR}", "efficiency", "pressures_sampler")
    return Table(f"Answers with pressures ({cohort_title}).", wide(table, ["subject"], "quantity"), columns)


def pressures_in_words(table: pd.DataFrame) -> Iterator[str]:
    """Yield what pressures tell of the circulation, in sentences."""
    for name in (RESISTANCE, TIME_CONSTANT):
        ratio = table.loc[table["quantity"] == name, "width_ratio"].dropna()
        if len(ratio):
            yield f"{quantity(name)}: intervals {fixed(float(ratio.median()), 2)} times as wide (median)"
