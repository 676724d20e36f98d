"""The section of the page on an experiment on speeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup

from swesbi.evaluation.verdict import STATUSES, status
from swesbi.report import captions
from swesbi.report.exact import (
    Exact,
    alarms_table,
    calibration_checks,
    calibration_summary,
    exact_table,
    identifiability_table,
    noise_table,
    outcomes_table,
    truth_table,
    verdicts_table,
)
from swesbi.report.figures import Figure, figure
from swesbi.report.headline import Fact
from swesbi.report.names import PARAMETERS
from swesbi.report.numbers import mean_sd, percent
from swesbi.report.recovery import level, nearest_level
from swesbi.report.subjects import derived_table, feature_table, score_table
from swesbi.report.table import Table

SHARED: Final = ("noise",)


@dataclass(frozen=True)
class Section:
    """What the templates show of one experiment on speeds."""

    name: str
    facts: tuple[Fact, ...]
    verdicts: tuple[Fact, ...]
    tables: Mapping[str, Table]
    figures: Mapping[str, Figure]


def make_section(exact: Exact, figures: Mapping[str, Figure], cohort_title: str) -> Section:
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
        "checks": calibration_checks(exact),
        "alarms": alarms_table(exact),
        "identifiability": identifiability_table(exact, cohort_title),
        "noise": noise_table(exact, cohort_title),
    }
    if len(exact.truth):
        tables["truth"] = truth_table(exact, cohort_title)
    verdicts = tuple(Fact(name, support.verdict) for name, support in exact.supports.items())
    return Section(experiment.name, tuple(_facts(exact)), verdicts, tables, figures)


def section_figures(pngs: Sequence[Path], experiment: str, page: Path, title: str) -> Mapping[str, Figure]:
    """Return the figures of an experiment by kind: ``calibration-{experiment}.png`` as "calibration".

    Those of ``SHARED`` belong to every experiment.
    """
    found = {}
    for png in pngs:
        kind = png.stem.removesuffix(f"-{experiment}")
        if kind != png.stem or kind in SHARED:
            texts = captions.of_experiment(kind, experiment, title)
            found[kind] = figure(png, page, *texts, png.with_suffix(".pdf"))
    return found


def _facts(exact: Exact) -> Iterator[Fact]:
    """Yield what an abstract would say."""
    experiment, found = exact.experiment, [status(part) for part in exact.supports.values()]
    yield Fact("Verdicts", ", ".join(f"{found.count(name)} {name}" for name in STATUSES if name in found))
    efficiencies = [100.0 * result.efficiency for result in exact.results.values()]
    by_mcmc = [name for name, result in exact.results.items() if result.by_mcmc]
    efficient = f"median efficiency of the weights {np.median(efficiencies):.0f} %"
    yield Fact("Exact posteriors", f"{efficient}; by MCMC: {', '.join(by_mcmc) or 'none'}")
    if len(experiment.supported):
        after = mean_sd(experiment.supported["rmse_kpa"].to_numpy(), 2)
        inside = mean_sd(100.0 * experiment.supported["coverage_phases"].to_numpy(), 0)
        yield Fact(
            "Predictive check",
            f"RMSE {after} kPa; {inside} % of the measured phases inside the "
            f"{experiment.predictive_percent:g} % band of new recordings",
        )
    for name, table in (("own", experiment.recovery.own), ("acquisition", experiment.recovery.acquisition)):
        nominal, covered = percent(nearest_level(table, experiment), 0), level(table, experiment)
        values = [Markup("{} {} %").format(PARAMETERS[key], percent(covered[key])) for key in PARAMETERS]
        yield Fact(f"Recovery with {name} noise: {nominal} % intervals cover", Markup("; ").join(values))
    known = exact.truth.dropna(subset="median") if len(exact.truth) else exact.truth
    if len(known):
        inside_count = int((known["inside"].astype(str) == "True").sum())
        yield Fact("Truth of the generated recordings", f"inside {inside_count} of {len(known)} intervals")
