"""The section of the page on an experiment over a population."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from swesbi.population.cohort import OUTCOMES
from swesbi.report import captions
from swesbi.report.figures import Figure, figure
from swesbi.report.headline import Fact
from swesbi.report.names import PARAMETERS
from swesbi.report.numbers import count, percent
from swesbi.report.population import OverPopulation, cohort_table, range_in_words, strata_table
from swesbi.report.results import records
from swesbi.report.table import Table

KINDS = ("cohort", "strata", "training")


@dataclass(frozen=True)
class PopulationSection:
    """What the templates show of one experiment over a population."""

    name: str
    base: str
    declared: str
    facts: tuple[Fact, ...]
    tables: Mapping[str, Table]
    figures: Mapping[str, Figure]


def make_population_section(
    shown: OverPopulation, figures: Mapping[str, Figure], cohort_title: str
) -> PopulationSection:
    """Put the section together."""
    return PopulationSection(
        name=shown.name,
        base=str(shown.settings["base"]),
        declared=range_in_words(shown.settings),
        facts=tuple(_facts(shown)),
        tables={"strata": strata_table(shown), "cohort": cohort_table(shown, cohort_title)},
        figures=figures,
    )


def population_figures(pngs: Sequence[Path], experiment: str, page: Path, title: str) -> dict[str, Figure]:
    """Return the figures of an experiment by kind: ``cohort-{experiment}.png`` as "cohort"."""
    names = {f"{kind}-{experiment}": kind for kind in KINDS}
    return {
        names[png.stem]: figure(
            png, page, *captions.of_population(names[png.stem], experiment, title), png.with_suffix(".pdf")
        )
        for png in pngs
        if png.stem in names
    }


def _facts(shown: OverPopulation) -> Iterator[Fact]:
    """Yield what an abstract would say."""
    simulations: Any = shown.settings["simulations"]
    drawn = count(simulations["contexts"] * simulations["draws_per_context"])
    yield Fact("Trained on", f"{count(simulations['contexts'])} contexts, {drawn} simulations")
    found = [
        f"{number} {name}" for name in OUTCOMES if (number := int((shown.cohort["status"] == name).sum()))
    ]
    yield Fact("Verdicts", ", ".join(found))
    if len(shown.answered):
        efficiency = float(shown.answered["efficiency"].astype(float).median())
        by_mcmc = int((shown.answered["sampler"] == "mcmc").sum())
        yield Fact("Exact posteriors", f"median efficiency {percent(efficiency, 0)} %; by MCMC: {by_mcmc}")
    table = shown.coverage[(shown.coverage["stratum"] == "all") & (shown.coverage["sampler"] == "weighted")]
    rows = {str(row["parameter"]): row for row in records(table)}
    covered = Markup("; ").join(
        Markup("{} {} %").format(symbol, percent(rows[name]["coverage"]))
        for name, symbol in PARAMETERS.items()
    )
    yield Fact(f"Fresh contexts: {percent(shown.interval, 0)} % intervals cover", covered)
