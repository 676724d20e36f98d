"""Parts of the page made of facts: a section for each experiment, and what they and the landing page say."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.report.figures.registry import Scope, on_page
from swesbi.report.numbers import PARAMETERS, count, in_sentences, mean_sd, percent, share, yes_or_no
from swesbi.report.results import Experiment
from swesbi.report.table import Table
from swesbi.report.tables.cohort_posterior import CohortSection
from swesbi.report.tables.exact import (
    alarms_table,
    calibration_summary,
    exact_table,
    failed_checks,
    identifiability_table,
    noise_table,
    outcomes_table,
    verdicts_table,
)
from swesbi.report.tables.population import (
    PopulationSection,
    cohort_table,
    pressures_in_words,
    pressures_subjects_table,
    pressures_table,
    range_in_words,
    strata_table,
)
from swesbi.report.tables.subjects import derived_table, feature_table, score_table, verdict_table
from swesbi.verdict.summary import OUTCOMES
from swesbi.verdict.verdict import STATUSES, Verdict

Facts = Mapping[str, str]
"""What each line is about, and what came out."""
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
SIZE_AT = slice(16, 24)


def relative(path: Path, page: Path) -> str:
    """Return how the page refers to a file."""
    return Path(os.path.relpath(path, page.parent)).as_posix()


@dataclass(frozen=True)
class Figure:
    """One figure: where it lies, its size in pixels, what it says to who cannot see it, and its caption."""

    source: str
    full: str
    width: int
    height: int
    description: str
    caption: str


def figure(png: Path, page: Path, description: str, caption: str, pdf: Path | None = None) -> Figure:
    """Return a figure of the page; a click leads to the PDF, or to the PNG where there is none."""
    with png.open("rb") as file:
        head = file.read(SIZE_AT.stop)
    if not head.startswith(PNG_SIGNATURE) or len(head) < SIZE_AT.stop:
        raise ArtefactError(f"{png}: is not a PNG image; delete it and rerun")
    width, height = struct.unpack(">II", head[SIZE_AT])
    return Figure(relative(png, page), relative(pdf or png, page), width, height, description, caption)


@dataclass(frozen=True)
class Section:
    """What the templates show of one experiment: facts as an abstract would have them, verdicts as sentences.

    ``base`` (whose prior and likelihood it has) and ``declared`` (its range) are of one over a population.
    """

    name: str
    tables: Mapping[str, Table]
    facts: Facts = field(default_factory=dict)
    figures: Mapping[str, Figure] = field(default_factory=dict)
    cohort: CohortSection | None = None
    verdicts: Facts = field(default_factory=dict)
    caution: str = ""
    base: str = ""
    declared: str = ""


def section_figures(
    scope: Scope, pngs: Sequence[Path], experiment: str, page: Path, title: str
) -> dict[str, Figure]:
    """Return the figures of an experiment by name: ``calibration-{experiment}.png`` as "calibration".

    A training over a population is of contexts that were drawn, not of the cohort.
    """
    specs = {spec.stem(experiment): spec for spec in on_page(scope).values()}
    made = {}
    for png in (png for png in pngs if png.stem in specs):
        spec = specs[png.stem]
        whose = "drawn contexts" if scope == "population" and spec.of == "experiment" else title
        texts = spec.texts(whose, experiment)
        made[spec.name] = figure(png, page, *texts, png.with_suffix(".pdf"))
    return made


_SHARED: Final = {"derived": derived_table, "scores": score_table, "features": feature_table}
_OF_SPEEDS: Final = {
    "verdicts": verdicts_table,
    "tests": outcomes_table,
    "posterior": exact_table,
    "identifiability": identifiability_table,
    "noise": noise_table,
}
_CHECKS: Final = {"calibration": calibration_summary, "checks": failed_checks, "alarms": alarms_table}


def make_section(
    experiment: Experiment, figures: Mapping[str, Figure], title: str, cohort: CohortSection | None = None
) -> Section:
    """Put the section of an experiment together: on features as the paper's, or on speeds."""
    tables = {name: of(experiment, title) for name, of in _SHARED.items()}
    facts: Facts = {}
    if experiment.exact:
        tables |= {name: of(experiment, title) for name, of in _OF_SPEEDS.items()}
        tables |= {name: of(experiment) for name, of in _CHECKS.items()}
        facts = dict(_exact_facts(experiment))
    else:
        tables["verdicts"] = verdict_table(experiment, title)
    verdicts = {name: in_sentences(verdict.sentence) for name, verdict in experiment.verdicts.items()}
    return Section(experiment.name, tables, facts, figures, cohort, verdicts, caution(experiment))


def counted(verdicts: Mapping[str, Verdict], order: Sequence[str] = STATUSES) -> str:
    """Return how many subjects have which verdict, and who: "2 not contradicted (A, B), 1 doubtful (D)"."""
    return ", ".join(
        f"{len(names)} {word} ({', '.join(names)})"
        for word in order
        if (names := [name for name, verdict in verdicts.items() if verdict.status == word])
    )


def coverages(table: pd.DataFrame, decimals: int = 1) -> str:
    """Return what intervals cover, "k_0 87.5 %, k_ATP ...", of a table whose index is the parameter."""
    return ", ".join(
        f"{PARAMETERS[str(name)]} {share(value, decimals)}" for name, value in table["coverage"].items()
    )


def truth_inside(truth: pd.DataFrame) -> str:
    """Return how many intervals contain the truth, "7 of 9 intervals"; nothing where no truth is known."""
    known = truth.dropna(subset="median") if len(truth) else truth
    if known.empty:
        return ""
    return f"{(known['inside'].map(yes_or_no) == 'yes').sum()} of {len(known)} intervals"


def too_narrow(table: pd.DataFrame) -> pd.DataFrame:
    """Return the parameters whose coverage lies, with its whole interval, below the nominal level."""
    return table[table["ci_high"] < table["nominal"]]


def caution(experiment: Experiment) -> str:
    """Return a warning where credible intervals cover less than they claim, else nothing.

    Judged by recordings with acquisition noise: the whole interval on the coverage lies below nominal.
    """
    low = too_narrow(experiment.at_level(experiment.recovery_acquisition))
    if low.empty:
        return ""
    return (
        f"The {share(low['nominal'].iloc[0], 0)} credible intervals of this experiment contain the truth "
        f"less often than their level when recordings have the noise of an acquisition: {coverages(low)}. "
        "They follow from the observation model of the experiment. They do not measure uncertainty after a "
        "measurement."
    )


def _exact_facts(experiment: Experiment) -> Iterator[tuple[str, str]]:
    """Yield what an abstract would say."""
    yield ("Verdicts", counted(experiment.verdicts))
    efficiencies = [result.efficiency for result in experiment.results.values()]
    by_mcmc = [name for name, result in experiment.results.items() if result.by_mcmc]
    yield ("Exact posteriors", _drawn(efficiencies, ", ".join(by_mcmc) or "none"))
    if len(experiment.passed):
        after = mean_sd(experiment.passed["rmse_kpa"], 2)
        inside = mean_sd(100.0 * experiment.passed["coverage_observed_phases"], 0)
        yield (
            "Predictive check",
            f"RMSE {after} kPa; {inside} % of the measured phases inside the "
            f"{experiment.predictive_percent:g} % band of new recordings",
        )
    recoveries = {"own": experiment.recovery, "acquisition": experiment.recovery_acquisition}
    for name, table in recoveries.items():
        covered = experiment.at_level(table)
        nominal = percent(covered["nominal"].iloc[0], 0)
        yield (f"Recovery with {name} noise: {nominal} % intervals cover the truth in", coverages(covered))
    if inside := truth_inside(experiment.truth):
        yield ("Truth of the simulated recordings", f"inside {inside}")


def _drawn(efficiencies: Iterable[float], by_mcmc: str) -> str:
    middle = percent(float(np.median(list(efficiencies))), 0)
    return f"median efficiency of the weights {middle} %; by MCMC: {by_mcmc}"


def make_population_section(
    shown: PopulationSection,
    figures: Mapping[str, Figure],
    title: str,
    cohort: CohortSection | None = None,
) -> Section:
    """Put the section together."""
    tables = {"strata": strata_table(shown), "cohort": cohort_table(shown, title)}
    if shown.pressures is not None:
        tables["pressures"] = pressures_table(shown.pressures, title)
        tables["pressures_subjects"] = pressures_subjects_table(shown.pressures, title)
    return Section(
        shown.name,
        tables,
        dict(_population_facts(shown)),
        figures,
        cohort,
        base=str(shown.settings["base"]),
        declared=range_in_words(shown.settings),
    )


def _population_facts(shown: PopulationSection) -> Iterator[tuple[str, str]]:
    """Yield what an abstract would say."""
    simulations: Any = shown.settings["simulations"]
    drawn = count(simulations["contexts"] * simulations["draws_per_context"])
    yield ("Trained on", f"{count(simulations['contexts'])} contexts, {drawn} simulations")
    numbers = shown.cohort["status"].value_counts()
    yield ("Verdicts", ", ".join(f"{numbers[name]} {name}" for name in OUTCOMES if name in numbers))
    answered = shown.answered
    if len(answered):
        by_mcmc = int((answered["sampler"] == "mcmc").sum())
        yield ("Exact posteriors", _drawn(answered["efficiency"].astype(float), str(by_mcmc)))
    if shown.pressures is not None:
        yield ("With cuff pressures", "; ".join(pressures_in_words(shown.pressures)))
    table = shown.coverage
    covered = table[(table["stratum"] == "all") & (table["sampler"] == "weighted")].set_index("parameter")
    yield (
        f"Fresh contexts: {percent(shown.interval, 0)} % intervals cover",
        coverages(covered.loc[list(PARAMETERS)]),
    )
