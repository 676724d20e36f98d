"""Tables that no stage of the study writes: made of a finished study's results where a page names them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.artefacts.typed import FOLDER
from swesbi.base.arrays import FloatArray
from swesbi.checks.identifiability import contraction
from swesbi.config.study import Study
from swesbi.networks import training as trainings
from swesbi.parameters import NUISANCES, PHI_NAMES, THETA_NAMES, NuisanceSettings
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import JointPriorSettings, even_quantiles, quantile
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.verdict.verdict import Verdict
from tools.docs.coverage import coverage_table

PROJECT: Final = Path(__file__).parents[2]
RANGE: Final = (0.5, 0.05, 0.95)


def verdicts_table(study: Study) -> pd.DataFrame:
    """Return the verdict of every experiment on every subject."""
    rows = [
        {
            "experiment": name,
            "subject": subject,
            "status": verdict.status,
            "may_be_read": verdict.may_be_read,
            "flagged": ", ".join(test.name for test in verdict.tests if test.flagged),
            "max_abs_z": verdict.max_abs_z,
            "worst_component": verdict.worst_component,
            "in_prior_draws": verdict.in_prior_draws,
            "candidate_draws": verdict.candidate_draws,
            "sampler": verdict.sampler,
            "efficiency": verdict.efficiency,
            "k_hat": verdict.k_hat,
            "reasons": "; ".join(verdict.reasons),
        }
        for name in (*study.config.experiments_run, *study.config.populations_run)
        for subject, verdict in _verdicts(study, name).items()
    ]
    return pd.DataFrame(rows)


def nuisances_table(study: Study) -> pd.DataFrame:
    """Return what is not known of a heart: prior, its reason, and how far the posteriors contract it.

    The contraction is 1 - var(log posterior) / var(log prior): median, least and largest over the subjects
    that are not contradicted.
    """
    name = _on_speeds(study)
    experiment = study.config.speed_experiments[name]
    prior = JointPriorSettings(
        theta=study.config.priors[experiment.prior], passive_stiffness_kpa=experiment.passive_stiffness_kpa
    )
    draws = [
        ExactPosterior.read(_folder_of(study, name, subject) / "posterior.h5").phi
        for subject, verdict in _verdicts(study, name).items()
        if verdict.may_be_read
    ]
    even = even_quantiles(prior)
    contracted = np.array([contraction(np.log(phi), np.log(even)) for phi in draws]).reshape(len(draws), -1)
    at_levels = quantile(np.outer(RANGE, np.ones(len(prior.parameters))), prior)
    known = {parameter.name: parameter for parameter in NUISANCES}
    rows = []
    for j, nuisance in enumerate(prior.nuisance_names, start=len(PHI_NAMES)):
        reason = (NuisanceSettings.model_fields[nuisance].description or "").partition(". ")[2]
        rows.append(
            {"parameter": nuisance, "meaning": known[nuisance].meaning, "unit": known[nuisance].unit}
            | dict(zip(("median", "low", "high"), at_levels[:, j], strict=True))
            | {"log_sd": prior.parameters[j].log_sd}
            | {"lower_bound": prior.parameters[j].low, "upper_bound": prior.parameters[j].high}
            | _spread("contraction", contracted[:, j] if draws else np.array([np.nan]))
            | {"source": reason}
        )
    return pd.DataFrame(rows)


def noise_table(study: Study) -> pd.DataFrame:
    """Return the noise of the measured speeds, and the model's discrepancy, in percent of the speed."""
    groups = CohortNoise.read(Path(study.config.results) / "cohort/noise.h5").groups
    rows = [
        [group, f"between {name}s", part.fraction, part.standard_error, part.low, part.high]
        for group, noise in groups.items()
        for name, part in noise.pooled.parts.items()
    ]
    discrepancy = study.config.speed_experiments[_on_speeds(study)].observation_model.discrepancy
    rows += [
        ["all", "model discrepancy in speed", discrepancy.speed_fraction, np.nan, np.nan, np.nan],
        ["all", "model discrepancy in timing, % of the cycle", discrepancy.timing_cycle, *[np.nan] * 3],
    ]
    columns = ["percent", "standard_error", "low", "high"]
    table = pd.DataFrame(rows, columns=["group", "component", *columns])
    return table.assign(**{name: 100.0 * table[name] for name in columns})


def epochs_table(study: Study) -> pd.DataFrame:
    """Return the first, the best and the last epoch of the main experiment that was looked at."""
    main = study.config.main_experiment
    supported = [name for name, verdict in _verdicts(study, main).items() if verdict.may_be_read]
    epochs = trainings.EPOCHS.read(Path(study.config.results) / main / "epochs.csv")
    best = int(epochs["epoch"][epochs["best"] == 1].iloc[0])
    return pd.DataFrame(
        [
            {"epoch": epoch, "best": epoch == best} | _of_epoch(epochs[epochs["epoch"] == epoch], supported)
            for epoch in sorted({int(epochs["epoch"].min()), best, int(epochs["epoch"].max())})
        ]
    )


def _of_epoch(rows: pd.DataFrame, supported: list[str]) -> dict[str, float]:
    by_quantity = {str(name): part for name, part in rows.groupby("quantity")}
    losses = (trainings.VALIDATION_LOSS, trainings.FRESH_LOSS)
    found = {name: float(by_quantity[name]["value"].iloc[0]) for name in losses}
    recovery = by_quantity[trainings.RECOVERY_COVERAGE].set_index("parameter")["value"]
    found |= {f"recovery_{name}": float(recovery[name]) for name in THETA_NAMES}
    for short, quantity in (
        ("coverage_phases", trainings.COVERAGE_PHASES),
        ("rmse", trainings.RMSE),
    ):
        part = by_quantity[quantity]
        values = part["value"][part["subject"].isin(supported)]
        found |= {f"{short}_low": float(values.min()), f"{short}_high": float(values.max())}
    widths = by_quantity[trainings.RELATIVE_SD]
    medians = widths[widths["subject"].isin(supported)].groupby("parameter")["value"].median()
    return found | {f"relative_sd_{name}": float(medians.get(name, np.nan)) for name in THETA_NAMES}


def _spread(name: str, values: FloatArray) -> dict[str, float]:
    ends = {f"{name}_low": float(values.min()), f"{name}_high": float(values.max())}
    return {name: float(np.median(values))} | ends


def _on_speeds(study: Study) -> str:
    """Return the first experiment on speeds that is run."""
    return next(name for name in study.config.experiments_run if name in study.config.speed_experiments)


def _verdicts(study: Study, name: str) -> dict[str, Verdict]:
    return {
        subject: Verdict.read(_folder_of(study, name, subject) / "verdict.json")
        for subject in study.subjects_of(name)
    }


def _folder_of(study: Study, experiment: str, subject: str) -> Path:
    """Return the folder of what an experiment says of a subject."""
    return Path(study.config.results) / experiment / FOLDER / subject


MADE: Final[Mapping[str, Callable[[Study], pd.DataFrame]]] = {
    "nuisances": nuisances_table,
    "verdicts": verdicts_table,
    "noise": noise_table,
    "epochs": epochs_table,
}
"""By the name of the table below ``docs/tables``."""
OF_STORED: Final[Mapping[str, Callable[[], pd.DataFrame]]] = {"coverage": lambda: coverage_table(PROJECT)}
"""Likewise, of tables that are made of stored ones."""
