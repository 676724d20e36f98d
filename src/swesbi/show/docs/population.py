"""The generated parts of the page on experiments over a population."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.calibration.ranked import SAMPLERS, WEIGHTED
from swesbi.config import Study
from swesbi.evaluation.check_names import ANSWERS
from swesbi.population.cohort import OUTCOMES, REFUSED, read_cohort
from swesbi.show.docs.numbers import NONE, fixed, share, table
from swesbi.show.figures.cohort import counted_reasons
from swesbi.show.figures.population import read_strata, stratum_label
from swesbi.theta import THETA_NAMES

FIGURES: Final = ("strata", "cohort")
SYMBOLS: Final = dict(zip(THETA_NAMES, ("k_0", "k_ATP", "k_SR"), strict=True))
COSTS: Final = {
    "dag_cpu_s": ("planning (s of processor time)", 0),
    "cpu_s": ("all jobs (s of processor time)", 0),
    "subjects_cpu_s": ("of these on subjects (s)", 0),
    "wall_s": ("wall time (s)", 0),
    "job_memory_mb": ("largest job (MB)", 0),
    "snakemake_memory_mb": ("Snakemake (MB)", 0),
}
EXPONENTS: Final = {
    "exponent": "exponent of growth",
    "exponent_largest": "exponent between the two largest",
}


@dataclass(frozen=True)
class PopulationResults:
    """Results of one experiment over a population.

    Attributes:
        name: Its name.
        interval: Mass of the credible intervals.
        cohort_title: What the subjects are ("virtual volunteers").
        strata: ``strata.csv``.
        cohort: ``cohort.csv``.
        scaling: The table of ``benchmarks/scaling.py``; None before it has run.
    """

    name: str
    interval: float
    cohort_title: str
    strata: pd.DataFrame
    cohort: pd.DataFrame
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
    try:
        return PopulationResults(
            name=name,
            interval=study.config.speed_experiments[base].exact.interval,
            cohort_title=study.config.cohort_title,
            strata=read_strata(folder / name / "strata.csv"),
            cohort=read_cohort(folder / name / "cohort.csv"),
            scaling=pd.read_csv(measured) if measured.is_file() else None,
        )
    except FileNotFoundError as error:
        raise ArtefactError(
            f"{error.filename} does not exist: finish the study first (make study)"
        ) from error


def strata_part(results: PopulationResults) -> str:
    """Show coverage by stratum, drawn and as a table, and the range over the strata."""
    shown = results.strata[np.isclose(results.strata["nominal"], results.interval)]
    rows = [
        _stratum(shown[(shown["stratum"] == name) & (shown["sampler"] == sampler)], str(name), sampler)
        for name in dict.fromkeys(shown["stratum"])
        for sampler in SAMPLERS
    ]
    reported = shown[shown["sampler"] == WEIGHTED]
    low, high = (share(reported["coverage"].agg(end)) for end in ("min", "max"))
    level = share(results.interval, 0)
    return (
        f"![Coverage by stratum](figures/strata-{results.name}.png)\n\nOver all strata and parameters, "
        f"{level} intervals of the exact posterior cover {low} to {high}.\n\n{table(rows)}"
    )


def cohort_part(results: PopulationResults) -> str:
    """Show the overview of the cohort, and count its verdicts."""
    rows = []
    for status in OUTCOMES:
        part = results.cohort[results.cohort["status"] == status]
        reasons = ", ".join(f"{name} ({number})" for name, number in counted_reasons(part).items())
        rows.append({"verdict": status, "subjects": str(len(part)), "reasons": reasons or NONE})
    answered = results.cohort[results.cohort["status"] != REFUSED]
    efficiency = share(answered["efficiency"].median(), 0)
    return (
        f"![Overview of the cohort](figures/cohort-{results.name}.png)\n\n{len(results.cohort)} "
        f"{results.cohort_title}; median efficiency of the weights {efficiency}.\n\n{table(rows)}"
    )


def scaling_part(results: PopulationResults) -> str:
    """Show what cohorts of several sizes cost, how that grows, and the projection."""
    if results.scaling is None:
        return "Not measured yet: `benchmarks/scaling.py`."
    rows = [_cost(row) for _, row in results.scaling.iterrows()]
    return f"![Cost of cohorts](figures/scaling.png)\n\n{table(rows)}"


PARTS: Final[Mapping[str, Callable[[PopulationResults], str]]] = {
    "strata": strata_part,
    "cohort": cohort_part,
    "scaling": scaling_part,
}


def _stratum(rows: pd.DataFrame, name: str, sampler: str) -> dict[str, str]:
    cells = {"stratum": stratum_label(name), "answer": ANSWERS[sampler]}
    for parameter, symbol in SYMBOLS.items():
        one = rows[rows["parameter"] == parameter]
        covered, low, high = (share(one[key].to_numpy()[0]) for key in ("coverage", "ci_low", "ci_high"))
        cells[symbol] = f"{covered} ({low} to {high})"
    efficiency = share(float(rows["median_efficiency"].median()), 0)
    return cells | {"recordings": str(int(rows["n"].max())), "efficiency": efficiency}


def _cost(row: pd.Series) -> dict[str, str]:
    exponent = row["kind"] in EXPONENTS
    whose = EXPONENTS[row["kind"]] if exponent else f"{int(row['subjects']):,}"
    if row["kind"] == "projected":
        whose += " (projected)"
    jobs = NONE if np.isnan(row["jobs"]) else str(int(row["jobs"]))
    cells = {"subjects": whose, "jobs": jobs}
    return cells | {
        label: fixed(float(row[name]), 2 if exponent else decimals)
        for name, (label, decimals) in COSTS.items()
    }
