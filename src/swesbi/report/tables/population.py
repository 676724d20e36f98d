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


def strata_table(shown: PopulationSection) -> Table:
    """Return coverage of both answers by stratum, with the efficiency of the weights."""
    columns = named(
        words("stratum", "Stratum", stratum_label),
        "answer",
        *each_parameter("coverage"),
        "n",
        "median_efficiency",
    )
    frame = wide(shown.coverage, ["stratum", "sampler"], "parameter")
    strata = list(frame["stratum"].unique())
    frame = frame.sort_values("stratum", key=lambda names: names.map(strata.index), kind="stable")
    frame[MARK] = frame["stratum"].map({"all": SUMMARY}).fillna("")
    level = percent(shown.interval, 0)
    note = (
        f"Nominal: {level} %. Each fresh context is recorded once under the model's own noise; none was "
        f"trained on. Intervals on coverage: {CLOPPER_PEARSON}."
    )
    return Table(f"Coverage of {level} % intervals by stratum, on fresh contexts.", frame, columns, note)


def cohort_table(shown: PopulationSection, cohort_title: str) -> Table:
    """Return a row a subject of a small cohort, counts of a large one."""
    small = len(shown.cohort) <= MOST_SHOWN
    return _subjects(shown, cohort_title) if small else counts_table(shown, cohort_title)


def counts_table(shown: PopulationSection, cohort_title: str, most_reasons: int | None = 3) -> Table:
    """Return how many subjects have which verdict, with the commonest reasons, or all where None is given."""
    rows = []
    for status in OUTCOMES:
        subjects = shown.cohort[shown.cohort["status"] == status]
        reasons = list(counted_reasons(subjects).items())[:most_reasons]
        row = {
            "status": status,
            "reasons": ", ".join(f"{reason} ({number})" for reason, number in reasons) or MISSING,
            "subjects": len(subjects),
            "share": len(subjects) / len(shown.cohort),
            "median_efficiency": float(subjects["efficiency"].median()),
        }
        rows.append(row)
    columns = named("status", "reasons", "subjects", "share", "median_efficiency")
    note = "Each subject has its row in cohort.csv, with context, reason, medians and limits."
    return Table(f"Verdicts over the cohort ({cohort_title}).", pd.DataFrame(rows), columns, note)


def _subjects(shown: PopulationSection, cohort_title: str) -> Table:
    answers = (f"answer {name}" for name in PHI_NAMES)
    columns = named("subject", "status", "reason", *answers, "k_hat", "efficiency", "sampler")
    note = (
        "Medians and credible intervals. "
        "Who lies outside the declared range is refused: the network has learnt nothing there. Grey: "
        "refused, or contradicted, whose posterior must not be used."
    )
    frame = marked(shown.cohort, shown.cohort["status"])
    return Table(f"Every subject as the network answers it ({cohort_title}).", frame, columns, note)


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
