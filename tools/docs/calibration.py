"""The generated parts of the page on an experiment on speeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.config.study import Study
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.result import read_exact_posterior
from swesbi.prior import JointPriorSettings
from swesbi.recording.noise import read_noise
from swesbi.report.numbers import MISSING, share
from swesbi.report.table import Table, markdown
from swesbi.report.tables.calibration import alarms_table, calibration_summary
from swesbi.report.tables.exact import (
    Exact,
    exact_table,
    identifiability_table,
    noise_table,
    truth_table,
    verdicts_table,
)
from swesbi.report.tables.subjects import score_table
from tools.docs.nuisances import Nuisance, nuisances, nuisances_part
from tools.docs.results import at_length, finished, of_experiment, read_experiment, read_table


@dataclass(frozen=True)
class CalibrationResults:
    """Results of one experiment on speeds.

    Attributes:
        shown: What the page of results shows of it too.
        cohort_title: What the subjects are ("virtual volunteers").
        nuisances: What is not known of a heart, with what the posteriors say of it.
    """

    shown: Exact
    cohort_title: str
    nuisances: tuple[Nuisance, ...]


def experiment_shown(study: Study) -> str | None:
    """Return the experiment on speeds that the page shows, the first that is run; None if none is."""
    names = (name for name in study.config.experiments_run if name in study.config.speed_experiments)
    return next(names, None)


def read_calibration_results(folder: Path, study: Study, name: str, docs: Path) -> CalibrationResults:
    """Read what the page shows.

    Args:
        folder: Results of the study.
        study: Configuration and cohort.
        name: The experiment.
        docs: Folder of the documentation, which holds tables of its own.

    Raises:
        ArtefactError: The study is not finished: a file is missing.
    """
    inferred, truth = folder / name, folder / "tables" / "truth.csv"
    known = (study.cohort / "truth.csv").is_file()
    with finished():
        shown = Exact(
            experiment=read_experiment(folder, study, name, docs),
            results={
                s: read_exact_posterior(inferred / "subjects" / s / "posterior.h5")
                for s in study.subjects_of(name)
            },
            calibration=read_table(at_length(folder, docs, name, "calibration")),
            misspecification=read_table(at_length(folder, docs, name, "misspecification")),
            identifiability=read_table(inferred / "identifiability.csv"),
            noise=read_noise(folder / "cohort" / "noise.h5"),
            truth=of_experiment(truth, name) if known else pd.DataFrame(),
        )
    return CalibrationResults(
        shown,
        study.config.cohort_title,
        _nuisances(study, name, shown),
    )


def _nuisances(study: Study, name: str, shown: Exact) -> tuple[Nuisance, ...]:
    experiment = study.config.speed_experiments[name]
    prior = JointPriorSettings(
        theta=study.config.priors[experiment.prior], passive_stiffness_kpa=experiment.passive_stiffness_kpa
    )
    read = [shown.results[subject].phi for subject, verdict in shown.verdicts.items() if verdict.may_be_read]
    return nuisances(prior, read)


def answer_part(results: CalibrationResults) -> str:
    """Say in a few lines what came out."""
    exact, experiment = results.shown, results.shown.experiment
    statuses = [verdict.status for verdict in exact.verdicts.values()]
    counted = ", ".join(f"{statuses.count(name)} {name}" for name in dict.fromkeys(statuses))
    covered = experiment.passed["coverage_phases"]
    phases = f"{share(covered.min(), 0)} to {share(covered.max(), 0)}" if len(covered) else MISSING
    own, acquired = (
        ", ".join(share(experiment.at_level(table)["coverage"][name]) for name in THETA_NAMES)
        for table in (experiment.recovery.own, experiment.recovery.acquisition)
    )
    lines = [
        f"- Verdicts ({results.cohort_title}): {counted}.",
        f"- Coverage of the measured phases by {experiment.predictive_percent:g} % bands of new "
        f"recordings: {phases} over the subjects not contradicted.",
        f"- {experiment.credible_percent:g} % credible intervals cover, with own noise, {own} of the true "
        f"k_0, k_ATP, k_SR; on recordings acquired sample by sample {acquired}.",
    ]
    if len(exact.truth):
        lines.append(
            f"- True parameters inside their {experiment.credible_percent:g} % intervals: {_inside(exact)}."
        )
    return "\n".join(lines)


def truth_part(results: CalibrationResults) -> str:
    """Show which intervals contain the true values of the generated recordings."""
    if not len(results.shown.truth):
        return "The cohort has no known true parameters."
    return f"Inside: {_inside(results.shown)}.\n\n{_with_title(truth_table)(results)}"


def _with_title(make: Callable[[Exact, str], Table]) -> Callable[[CalibrationResults], str]:
    return lambda results: markdown(make(results.shown, results.cohort_title))


def _plain(make: Callable[[Exact], Table]) -> Callable[[CalibrationResults], str]:
    return lambda results: markdown(make(results.shown))


def _inside(exact: Exact) -> str:
    known = exact.truth.dropna(subset="median")
    return f"{int((known['inside'].astype(str) == 'True').sum())} of {len(known)}"


PARTS: Final[Mapping[str, Callable[[CalibrationResults], str]]] = {
    "answer": answer_part,
    "noise": _with_title(noise_table),
    "nuisances": lambda results: nuisances_part(results.nuisances),
    "verdicts": _with_title(verdicts_table),
    "posteriors": _with_title(exact_table),
    "truth": truth_part,
    "scores": lambda results: markdown(score_table(results.shown.experiment, results.cohort_title)),
    "calibration": _plain(calibration_summary),
    "alarms": _plain(alarms_table),
    "identifiability": _with_title(identifiability_table),
}
