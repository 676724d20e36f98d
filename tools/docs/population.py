"""The generated parts of the page on experiments over a population."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import log
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.checks.calibration.ranks import WEIGHTED
from swesbi.config.study import Study
from swesbi.report.figures.population import read_strata
from swesbi.report.numbers import fixed, share
from swesbi.report.table import Table, markdown
from swesbi.report.tables.population import OverPopulation, counts_table, strata_table
from swesbi.report.tables.pressures import pressures_of, pressures_table, subjects_table
from swesbi.verdict.answers import read_cohort
from tools.docs.results import at_length, finished

LEAST_SHOWN_S: Final = 60.0
"""Stages of less processor time for the largest cohort are in no row of their own."""


@dataclass(frozen=True)
class PopulationResults:
    """Results of one experiment over a population.

    Attributes:
        shown: What the page of results shows of it too.
        cohort_title: What the subjects are ("virtual volunteers").
        scaling: The table of ``benchmarks/scaling.py``; None before it has run.
    """

    shown: OverPopulation
    cohort_title: str
    scaling: pd.DataFrame | None


def read_population_results(folder: Path, study: Study, name: str, docs: Path) -> PopulationResults:
    """Read what the page shows.

    Args:
        folder: Results of the study.
        study: Configuration and cohort.
        name: The experiment.
        docs: Folder of the documentation, which holds a table of its own.

    Raises:
        ArtefactError: The study is not finished, or a table is not what its name says.
    """
    base, measured = study.config.base_of(name), docs / "tables" / "scaling.csv"
    with finished():
        shown = OverPopulation(
            name=name,
            settings=study.config.population_experiments[name].model_dump(mode="json"),
            interval=study.config.speed_experiments[base].exact.interval,
            cohort=read_cohort(folder / name / "cohort.csv"),
            strata=read_strata(at_length(folder, docs, name, "strata")),
            pressures=pressures_of(_table_of_pressures(folder, study, name), name),
        )
    scaling = pd.read_csv(measured) if measured.is_file() else None
    return PopulationResults(shown, study.config.cohort_title, scaling)


def _table_of_pressures(folder: Path, study: Study, name: str) -> list[Path]:
    """Return the table of what pressures add, of a study in which any were taken."""
    return [folder / "tables" / "pressures.csv"] if study.with_pressures(name) else []


def strata_part(results: PopulationResults) -> str:
    """Show coverage by stratum, drawn and as a table, and the range over the strata."""
    shown = results.shown
    reported = shown.coverage[shown.coverage["sampler"] == WEIGHTED]
    low, high = (share(reported["coverage"].agg(end)) for end in ("min", "max"))
    return (
        f"![Coverage by stratum](figures/strata-{shown.name}.png)\n\nOver all strata and parameters, "
        f"{share(shown.interval, 0)} intervals of the exact posterior cover {low} to {high}.\n\n"
        f"{markdown(strata_table(shown))}"
    )


def cohort_part(results: PopulationResults) -> str:
    """Show the overview of the cohort, and count its verdicts."""
    shown = results.shown
    efficiency = share(shown.answered["efficiency"].median(), 0)
    return (
        f"![Overview of the cohort](figures/cohort-{shown.name}.png)\n\n{len(shown.cohort)} "
        f"{results.cohort_title}; median efficiency of the weights {efficiency}.\n\n"
        f"{markdown(counts_table(shown, results.cohort_title, most_reasons=None))}"
    )


def scaling_part(results: PopulationResults) -> str:
    """Show what cohorts of several sizes cost by stage, and how that grows between the two largest."""
    if results.scaling is None:
        return "Not measured yet: `benchmarks/scaling.py`."
    measured = results.scaling
    sizes = sorted(int(size) for size in measured["subjects"].unique())
    costs = {
        str(stage): [float(one) for one in rows.sort_values("subjects")["cpu_s"]]
        for stage, rows in measured.groupby("stage")
        if len(rows) == len(sizes)
    }
    few, many = sizes[-2:]
    rows = [
        {"processor time (s)": stage.replace("_", " ")}
        | {f"{size} subjects": fixed(cost, 0) for size, cost in zip(sizes, of_stage, strict=True)}
        | {f"exponent, {few} to {many}": fixed(log(of_stage[-1] / of_stage[-2]) / log(many / few), 2)}
        for stage, of_stage in sorted(costs.items(), key=lambda item: -item[1][-1])
        if of_stage[-1] >= LEAST_SHOWN_S
    ]
    return f"![Cost of cohorts](figures/scaling.png)\n\n{markdown(Table('', pd.DataFrame(rows)))}"


def pressures_part(results: PopulationResults) -> str:
    """Show what cuff pressures add to the answers, drawn and in two tables."""
    shown, title = results.shown, results.cohort_title
    if shown.pressures is None:
        return f"None of the {title} has cuff pressures."
    return (
        f"![Without and with cuff pressures](figures/pressures-{shown.name}.png)\n\n"
        f"{markdown(pressures_table(shown.pressures, title))}\n\n"
        f"{markdown(subjects_table(shown.pressures, title))}"
    )


PARTS: Final[Mapping[str, Callable[[PopulationResults], str]]] = {
    "strata": strata_part,
    "cohort": cohort_part,
    "pressures": pressures_part,
    "scaling": scaling_part,
}
