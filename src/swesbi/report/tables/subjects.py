"""Tables of the subjects: context, recording, verdict, predictive scores, features, posterior."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Final

import pandas as pd

from swesbi.context import CONTEXT_NAMES
from swesbi.recording.observation import Observation
from swesbi.report.columns import each_parameter, named
from swesbi.report.numbers import MISSING, PARAMETERS, count
from swesbi.report.results import Experiment, records
from swesbi.report.table import MARK, SUMMARY, Table
from swesbi.verdict.verdict import Status

OF_FEATURES: Final = (
    "Table 1. ",
    Status.PRIOR_SUPPORTED,
    "noise of Eq. 5 on the whole curve: that of the maximum as a scale, that of the time to peak as a shift",
    "Subjects outside the prior's support have no posterior scores.",
)
OF_SPEEDS: Final = (
    "",
    Status.NOT_CONTRADICTED,
    "noise of the measured speeds and discrepancy of the model",
    "Contradicted subjects have no posterior scores; doubtful ones do, and are left out of the mean.",
)
"""Of the table of scores: its number, which subjects its mean is of, their noise, and who is left out."""
SCORES: Final = (
    "rmse_prior_kpa", "rmse_kpa", "rmse_reduction_percent", "nrmse", "r2", "post_peak_rmse_kpa",
    "coverage_noiseless_grid", "coverage_noiseless_phases", "rmse_cmaes_kpa", "coverage_observed_grid",
    "coverage_observed_phases", "coverage_prior_band_grid", "coverage_prior_envelope_grid",
)  # fmt: skip
"""Table 1 of the paper, of ``ppc.csv``."""
POSTERIOR: Final = ("median", "interval", *each_parameter("correlation"), "unfiltered_median", "cmaes")
"""Of the three parameters, of ``posterior.csv``."""
ENDS: Final = {"ci_low": "low", "ci_high": "high"}
"""Ends of credible intervals as other tables call them."""
DERIVED: Final = ("subject", "derived", "derived_unit", "derived_median", "derived_interval", "measured")
"""What follows from them, of ``posterior.csv``."""


def context_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return the context c_d of each subject; the ejection fraction is that of the measured volumes."""
    _, *before, last = CONTEXT_NAMES
    return Table(
        f"Context of each subject ({cohort_title}).",
        pd.DataFrame([vars(observation.context) for observation in observations]),
        named("subject", "sex", *before, "ejection", last),
        "LVEDV, LVESV: left ventricular end-diastolic and end-systolic volume; septal thickness at "
        "end diastole. Heart rate, LVEDV and septal thickness set the simulator; "
        "all seven condition the posterior.",
    )


def recording_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return what quality control accepted and rejected of each recording, and why."""
    frame = pd.DataFrame([_recording(observation) for observation in observations])
    reasons = (reason for reason in observations[0].rejected if frame[reason].any())
    return Table(
        f"Recordings and quality control ({cohort_title}).",
        frame,
        named("subject", "phases", "samples", *reasons, "between", "within", "stiffness"),
        "Each rejected sample counts once, for the first reason that applies. Stiffness is the range of the "
        "measured phases.",
    )


def _recording(observation: Observation) -> dict[str, object]:
    accepted = int(observation.samples_accepted.sum())
    stiffness = observation.stiffness_kpa[observation.measured]
    return {
        "subject": observation.subject,
        "measured": int(observation.measured.sum()),
        "phases": len(observation.phase),
        "accepted": accepted,
        "recorded": accepted + sum(observation.rejected.values()),
        **observation.rejected,
        "between": observation.noise.repeat_fraction,
        "within": observation.noise.sample_fraction,
        "lowest": float(stiffness.min()),
        "highest": float(stiffness.max()),
    }


def verdict_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the outcome of both support criteria for each subject."""
    rows = [
        {"subject": name, "acceptance": verdict.acceptance, **vars(verdict), **verdict.unfiltered_median}
        for name, verdict in experiment.verdicts.items()
    ]
    required = experiment.settings["support"]
    least, of = (count(required[name]) for name in ("min_in_prior_draws", "candidate_draws"))
    criteria = ("max_abs_z", "worst_component", "in_prior_draws", "acceptance")
    return Table(
        f"Does the prior support the subject? ({cohort_title})",
        experiment.marked(pd.DataFrame(rows)),
        named("subject", "status", *criteria, *each_parameter("unfiltered")),
        f"Required: |z| ≤ {required['max_abs_z']:g} in every component of the standardised feature-context "
        f"vector, and {least} of {of} candidate draws within the prior's bounds. Unfiltered: median of all "
        "candidates.",
    )


def score_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return table 1: the predictive scores of each subject, and their mean over those that pass."""
    mass = f"{experiment.predictive_percent:g} %"
    number, passed, noise, left_out = OF_SPEEDS if experiment.exact else OF_FEATURES
    return Table(
        f"{number}Posterior predictive performance ({cohort_title}).",
        with_mean(experiment.marked(experiment.scores), experiment.passed, f"{passed}, "),
        named("subject", *SCORES),
        "RMSE of the predictive median against the observed curve; reduction against the prior's. Coverage: "
        f"share of the observed curve inside the {mass} band of noiseless curves, or the {mass} interval of "
        f"new observations ({noise}). The prior's band and the extremes of all its draws are the ceiling of "
        f"the first. {left_out}",
    )


def with_mean(scores: pd.DataFrame, passed: pd.DataFrame, label: str = "") -> pd.DataFrame:
    """Return scores with two rows more where several pass: mean and standard deviation of those."""
    if len(passed) < 2:
        return scores
    numbers = passed[list(SCORES)]
    rows = [
        {"subject": f"{label}mean", MARK: SUMMARY, **numbers.mean()},
        {"subject": f"{label}sd", MARK: SUMMARY, **numbers.std(ddof=1)},
    ]
    return pd.concat([scores, pd.DataFrame(rows)])


def feature_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the checked features of each subject: observed, predicted, inside or not."""
    predicted = ("prior_median", "predicted_median", "predicted_interval", "inside")
    return Table(
        f"The features that carry noise ({cohort_title}).",
        experiment.marked(experiment.features),
        named("subject", "feature", "feature_unit", "observed", *predicted),
        f"Intervals, {experiment.predictive_percent:g} %, are those of a new observation, the observation "
        "model's noise included.",
    )


def posterior_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return medians, credible intervals and correlations of the three parameters by experiment."""
    table = pd.concat(
        each.marked(parameters_of(each.posterior)).assign(experiment=each.name) for each in experiments
    )
    order = [f"{subject} {name}" for subject in table["subject"].unique() for name in PARAMETERS]
    places = (table["subject"] + " " + table["parameter"]).map(order.index)
    return Table(
        f"Posterior of the three parameters, by experiment ({cohort_title}).",
        table.iloc[places.argsort(kind="stable")],
        named("subject", "parameter", "unit", "experiment", *POSTERIOR),
        f"Intervals: {_masses(experiments)}. The unfiltered median is of all candidate draws, whether or not "
        "the prior allows them. A dash: the prior does not support the subject, or the recording contradicts "
        "the model.",
    )


def _masses(experiments: Sequence[Experiment]) -> str:
    """Return the masses of credible intervals, with the experiments where these differ in it."""
    by_mass: dict[str, list[str]] = {}
    for each in experiments:
        by_mass.setdefault(f"{each.credible_percent:g} %", []).append(each.name)
    if len(by_mass) == 1:
        return next(iter(by_mass))
    return ", ".join(f"{mass} ({', '.join(names)})" for mass, names in by_mass.items())


def parameters_of(posterior: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the three parameters, without the correlation of each with itself."""
    table = posterior[posterior["parameter"].isin(PARAMETERS)].rename(columns=ENDS)
    others = {f"correlation_{name}": table["parameter"] != name for name in PARAMETERS}
    return table.assign(**{column: table[column].where(other) for column, other in others.items()})


def derived_of(posterior: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of what follows from the parameters, of subjects that may be interpreted."""
    return posterior[~posterior["parameter"].isin(PARAMETERS) & posterior["may_be_read"]].rename(columns=ENDS)


def derived_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return what a cardiologist reads: quantities of the posterior predictive simulations."""
    table = derived_of(experiment.posterior)
    beside = [beside_the_measured(row) for row in records(table)]
    return Table(
        f"Derived quantities ({cohort_title}).",
        experiment.marked(table.assign(beside=beside)),
        named(*DERIVED, "beside"),
        f"{experiment.intervals} From the simulations that the posterior draws give. "
        "The fit sees the stiffness curve alone; the measured volumes enter only as context. Beside it: "
        "whether the interval holds what was measured. Where it does not, the model's beat is not the "
        "subject's.",
    )


def beside_the_measured(row: Mapping[Hashable, Any]) -> str:
    """Return in words how a derived quantity's interval lies to the measured; a dash where nothing was."""
    if pd.isna(row["measured"]) or pd.isna(row["median"]):
        return MISSING
    if row["low"] <= row["measured"] <= row["high"]:
        return "holds the measured"
    return "predicted above measured" if row["low"] > row["measured"] else "predicted below measured"
