"""Parts of the page made of facts: the headline, a section an experiment on speeds or over a population."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from swesbi.report.numbers import PARAMETERS, count, fixed, in_sentences, mean_sd, percent, share
from swesbi.report.page.figures import PagePart, figures_of
from swesbi.report.page.files import Figure, figure
from swesbi.report.results import Experiment, is_true, records
from swesbi.report.table import Table
from swesbi.report.tables.calibration import alarms_table, calibration_summary, failed_checks
from swesbi.report.tables.cohort_posterior import CohortSection
from swesbi.report.tables.exact import (
    Exact,
    exact_table,
    identifiability_table,
    noise_table,
    outcomes_table,
    truth_table,
    verdicts_table,
)
from swesbi.report.tables.experiments import PAIRS, correlations
from swesbi.report.tables.population import PopulationSection, cohort_table, range_in_words, strata_table
from swesbi.report.tables.pressures import in_words, pressures_table, subjects_table
from swesbi.report.tables.subjects import derived_table, feature_table, score_table
from swesbi.verdict.summary import OUTCOMES
from swesbi.verdict.verdict import STATUSES, Verdict

Facts = Mapping[str, str]
"""What each line is about, and what came out."""


def headline(experiment: Experiment) -> Facts:
    """Return the facts that an abstract would give."""
    return dict(_facts(experiment))


def verdicts_in_words(verdicts: Mapping[str, Verdict]) -> Facts:
    """Return the verdict of each subject as a sentence."""
    return {name: in_sentences(verdict.sentence) for name, verdict in verdicts.items()}


def caution(experiment: Experiment) -> str:
    """Return a warning where credible intervals cover less than they claim, else nothing.

    Judged by recordings with acquisition noise: the whole interval on the coverage lies below nominal.
    """
    table = experiment.at_level(experiment.recovery.acquisition)
    low = table[table["ci_high"] < table["nominal"]]
    if low.empty:
        return ""
    nominal = float(low["nominal"].iloc[0])
    covered = [f"{PARAMETERS[str(name)]} ({share(value)})" for name, value in low["coverage"].items()]
    return (
        f"The {share(nominal, 0)} credible intervals of this experiment contain the truth less often than "
        f"their level when recordings have the noise of an acquisition: {', '.join(covered)}. They follow "
        "from the observation model of the experiment. They do not measure uncertainty after a measurement."
    )


def _facts(experiment: Experiment) -> Iterator[tuple[str, str]]:
    verdicts, scores = experiment.verdicts, experiment.passed
    yield ("Subjects that the prior supports", f"{len(scores)} of {len(verdicts)}")
    if len(scores):
        before, after = (mean_sd(scores[name].to_numpy(), 2) for name in ("rmse_prior_kpa", "rmse_kpa"))
        reduction = mean_sd(scores["rmse_reduction_percent"].to_numpy(), 1)
        yield (
            "RMSE of the predictive median, prior → posterior",
            f"{before} → {after} kPa, reduced by {reduction} %",
        )
        yield from _coverage_facts(experiment)
        pairs = [_correlation(experiment, *pair) for pair in PAIRS]
        yield ("Posterior correlations", "; ".join(pairs))
    yield from _recovered(experiment)


def _coverage_facts(experiment: Experiment) -> Iterator[tuple[str, str]]:
    """Yield both readings of the predictive interval, and the ceiling of the first."""
    mass = f"{experiment.predictive_percent:g} %"
    covered = {
        name.removeprefix("coverage_"): mean_sd(100.0 * experiment.passed[name], 0)
        for name in map(str, experiment.passed)
        if name.startswith("coverage_")
    }
    kinds = {"noiseless": "band of noiseless curves", "observed": "interval of new observations"}
    for kind, what in kinds.items():
        grid, phases = covered[f"{kind}_grid"], covered[f"{kind}_phases"]
        yield (
            f"The {mass} {what} covers",
            f"{grid} % of the observed curve, {phases} % of the measured phases",
        )
    yield (
        "Ceiling of the noiseless band",
        f"the prior's own covers {covered['prior_band_grid']} % of the observed curve, the envelope of all "
        f"its draws {covered['prior_envelope_grid']} %",
    )


def _recovered(experiment: Experiment) -> Iterator[tuple[str, str]]:
    for name, table in (("own", experiment.recovery.own), ("acquisition", experiment.recovery.acquisition)):
        covered = experiment.at_level(table)
        nominal = percent(covered["nominal"].iloc[0], 0)
        values = [f"{PARAMETERS[str(key)]} {share(value)}" for key, value in covered["coverage"].items()]
        yield (f"Recovery with {name} noise: {nominal} % intervals cover the truth in", "; ".join(values))


def _correlation(experiment: Experiment, one: str, other: str) -> str:
    value = mean_sd(correlations(experiment, one, other), 2)
    return f"{PARAMETERS[one]}, {PARAMETERS[other]}: {value}"


@dataclass(frozen=True)
class Section:
    """What the templates show of one experiment on speeds or over a population.

    Attributes:
        name: Its name.
        facts: What an abstract would say.
        tables: Tables by name.
        figures: Figures by name.
        cohort: The cohort as one population.
        verdicts: Of an experiment on speeds, the verdict of each subject as a sentence.
        base: Of an experiment over a population, the one whose prior and likelihood it has.
        declared: Likewise, the declared range.
    """

    name: str
    facts: Facts
    tables: Mapping[str, Table]
    figures: Mapping[str, Figure]
    cohort: CohortSection | None
    verdicts: Facts = field(default_factory=dict)
    base: str = ""
    declared: str = ""


def make_section(
    exact: Exact, figures: Mapping[str, Figure], cohort_title: str, cohort: CohortSection | None = None
) -> Section:
    """Put the section together."""
    experiment = exact.experiment
    tables = {
        "verdicts": verdicts_table(exact, cohort_title),
        "tests": outcomes_table(exact, cohort_title),
        "posterior": exact_table(exact, cohort_title),
        "derived": derived_table(experiment, cohort_title),
        "scores": score_table(experiment, cohort_title),
        "features": feature_table(experiment, cohort_title),
        "calibration": calibration_summary(exact),
        "checks": failed_checks(exact),
        "alarms": alarms_table(exact),
        "identifiability": identifiability_table(exact, cohort_title),
        "noise": noise_table(exact, cohort_title),
    }
    if len(exact.truth):
        tables["truth"] = truth_table(exact, cohort_title)
    said = verdicts_in_words(exact.verdicts)
    return Section(experiment.name, dict(_exact_facts(exact)), tables, figures, cohort, said)


def section_figures(
    part: PagePart, pngs: Sequence[Path], experiment: str, page: Path, title: str
) -> dict[str, Figure]:
    """Return the figures of an experiment by name: ``calibration-{experiment}.png`` as "calibration"."""
    specs = {spec.stem(experiment): spec for spec in figures_of(part).values()}
    return {
        specs[png.stem].name: figure(
            png, page, *specs[png.stem].texts(title, experiment), png.with_suffix(".pdf")
        )
        for png in pngs
        if png.stem in specs
    }


def _exact_facts(exact: Exact) -> Iterator[tuple[str, str]]:
    """Yield what an abstract would say."""
    experiment, statuses = exact.experiment, [verdict.status for verdict in exact.verdicts.values()]
    yield ("Verdicts", ", ".join(f"{statuses.count(name)} {name}" for name in STATUSES if name in statuses))
    efficiencies = [100.0 * result.efficiency for result in exact.results.values()]
    by_mcmc = [name for name, result in exact.results.items() if result.by_mcmc]
    efficient = f"median efficiency of the weights {fixed(float(np.median(efficiencies)), 0)} %"
    yield ("Exact posteriors", f"{efficient}; by MCMC: {', '.join(by_mcmc) or 'none'}")
    if len(experiment.passed):
        after = mean_sd(experiment.passed["rmse_kpa"].to_numpy(), 2)
        inside = mean_sd(100.0 * experiment.passed["coverage_observed_phases"].to_numpy(), 0)
        yield (
            "Predictive check",
            f"RMSE {after} kPa; {inside} % of the measured phases inside the "
            f"{experiment.predictive_percent:g} % band of new recordings",
        )
    yield from _recovered(experiment)
    known = exact.truth.dropna(subset="median") if len(exact.truth) else exact.truth
    if len(known):
        inside_count = int(known["inside"].map(is_true).sum())
        yield ("Truth of the simulated recordings", f"inside {inside_count} of {len(known)} intervals")


def make_population_section(
    shown: PopulationSection,
    figures: Mapping[str, Figure],
    cohort_title: str,
    cohort: CohortSection | None = None,
) -> Section:
    """Put the section together."""
    tables = {"strata": strata_table(shown), "cohort": cohort_table(shown, cohort_title)}
    if shown.pressures is not None:
        tables["pressures"] = pressures_table(shown.pressures, cohort_title)
        tables["pressures_subjects"] = subjects_table(shown.pressures, cohort_title)
    base, declared = str(shown.settings["base"]), range_in_words(shown.settings)
    facts = dict(_population_facts(shown))
    return Section(shown.name, facts, tables, figures, cohort, base=base, declared=declared)


def _population_facts(shown: PopulationSection) -> Iterator[tuple[str, str]]:
    """Yield what an abstract would say."""
    simulations: Any = shown.settings["simulations"]
    drawn = count(simulations["contexts"] * simulations["draws_per_context"])
    yield ("Trained on", f"{count(simulations['contexts'])} contexts, {drawn} simulations")
    verdicts = [
        f"{number} {name}" for name in OUTCOMES if (number := int((shown.cohort["status"] == name).sum()))
    ]
    yield ("Verdicts", ", ".join(verdicts))
    if len(shown.answered):
        efficiency = float(shown.answered["efficiency"].astype(float).median())
        by_mcmc = int((shown.answered["sampler"] == "mcmc").sum())
        yield ("Exact posteriors", f"median efficiency {percent(efficiency, 0)} %; by MCMC: {by_mcmc}")
    if shown.pressures is not None:
        yield ("With cuff pressures", "; ".join(in_words(shown.pressures)))
    table = shown.coverage[(shown.coverage["stratum"] == "all") & (shown.coverage["sampler"] == "weighted")]
    rows = {str(row["parameter"]): row for row in records(table)}
    covered = "; ".join(f"{symbol} {share(rows[name]['coverage'])}" for name, symbol in PARAMETERS.items())
    yield (f"Fresh contexts: {percent(shown.interval, 0)} % intervals cover", covered)
