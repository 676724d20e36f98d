"""The generated parts of the page on experiments over a population."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.checks.calibration.ranks import WEIGHTED
from swesbi.config.study import Study
from swesbi.show.docs.results import at_length, finished
from swesbi.show.figures.population import read_strata
from swesbi.show.numbers import MISSING, fixed, share
from swesbi.show.table import markdown, of_records
from swesbi.show.tables.population import OverPopulation, counts_table, strata_table
from swesbi.show.tables.pressures import pressures_of, pressures_table, subjects_table
from swesbi.verdict.answers import read_cohort

COSTS: Final = {
    "dag_cpu_s": ("planning (s of processor time)", 0),
    "cpu_s": ("all jobs (s of processor time)", 0),
    "subjects_cpu_s": ("of these on subjects (s)", 0),
    "wall_s": ("wall time (s)", 0),
    "job_memory_mb": ("largest job (MB)", 0),
    "snakemake_memory_mb": ("Snakemake (MB)", 0),
}
EXPONENTS: Final = {"exponent": "exponent of growth", "exponent_largest": "exponent between the two largest"}


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
    """Show what cohorts of several sizes cost, how that grows, and the projection."""
    if results.scaling is None:
        return "Not measured yet: `benchmarks/scaling.py`."
    rows = [_cost(row) for _, row in results.scaling.iterrows()]
    return f"![Cost of cohorts](figures/scaling.png)\n\n{markdown(of_records(rows))}"


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


def _cost(row: pd.Series) -> dict[str, str]:
    exponent = row["kind"] in EXPONENTS
    whose = EXPONENTS[row["kind"]] if exponent else f"{int(row['subjects']):,}"
    if row["kind"] == "projected":
        whose += " (projected)"
    jobs = MISSING if np.isnan(row["jobs"]) else str(int(row["jobs"]))
    cells = {"subjects": whose, "jobs": jobs}
    return cells | {
        label: fixed(float(row[name]), 2 if exponent else decimals)
        for name, (label, decimals) in COSTS.items()
    }
