"""An experiment over a population: coverage by stratum, who is answered and who refused, with what reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from pydantic import JsonValue

from swesbi.context import CONTEXT
from swesbi.parameters import PHI_NAMES
from swesbi.population.settings import DECLARED_NAMES, MOST_SHOWN
from swesbi.report.columns import each_parameter, named
from swesbi.report.figures.cohort import counted_reasons
from swesbi.report.figures.strata import stratum_label
from swesbi.report.numbers import MISSING, percent
from swesbi.report.results import marked, wide
from swesbi.report.table import MARK, SUMMARY, Table, words
from swesbi.report.tables.calibration import CLOPPER_PEARSON
from swesbi.verdict.summary import OUTCOMES, REFUSED


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


def counts_table(shown: PopulationSection, cohort_title: str, most_reasons: int | None = 3) -> Table:
    """Return how many subjects have which verdict, with the commonest reasons, or all where None is given."""
    rows = []
    for status in OUTCOMES:
        subjects = shown.cohort[shown.cohort["status"] == status]
        reasons = list(counted_reasons(subjects).items())[:most_reasons]
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
