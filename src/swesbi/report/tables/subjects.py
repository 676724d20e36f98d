"""Tables of the subjects: context, recording, verdict, predictive scores, features, posterior."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from swesbi.context import CONTEXT, Context
from swesbi.recording.observation import Observation
from swesbi.report import numbers
from swesbi.report.results import Experiment, records
from swesbi.report.study_tables import CEILING
from swesbi.report.table import Column, Row, Table, body, words
from swesbi.verdict.verdict import NOT_CONTRADICTED, PRIOR_SUPPORTED, STRAINED

MEASURED: Final = CONTEXT[1:]  # but for sex, which is shown as it is entered
EJECTED_AT: Final = 3 + [variable.name for variable in MEASURED].index("lvesv_ml")
"""Where the ejection fraction stands: behind the volumes."""
DECIMALS: Final = {"mL": 0, "kPa": 1, "1": 2}
"""By unit, what a scanner can tell of a derived quantity."""
DERIVED_UNITS: Final = {"1": "", "1/s": numbers.PARAMETER_UNITS["k_sr_per_s"]}


@dataclass(frozen=True)
class CoverageReading:
    """One reading of the predictive interval: what tables call it, and its columns of ``ppc.csv``."""

    name: str
    columns: tuple[str, str]


NOISELESS: Final = CoverageReading(
    "noiseless curves", ("coverage_noiseless_grid", "coverage_noiseless_phases")
)
FEATURE_NOISE: Final = (
    "noise of Eq. 5 on the whole curve: that of the maximum as a scale, that of the time to peak as a shift"
)
SPEED_NOISE: Final = "noise of the measured speeds and discrepancy of the model"
NOISY: Final = CoverageReading("new observations", ("coverage_observed_grid", "coverage_observed_phases"))


def context_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return the context c_d of each subject; the ejection fraction is that of the measured volumes."""
    columns = [
        *words("Subject", "Sex"),
        *(
            Column(variable.words[0].upper() + variable.words[1:], variable.shown_unit)
            for variable in MEASURED
        ),
    ]
    columns.insert(EJECTED_AT, Column("Ejection fraction", "%"))
    rows = [_context(observation.context) for observation in observations]
    note = (
        "LVEDV, LVESV: left ventricular end-diastolic and end-systolic volume; septal thickness at "
        "end diastole. Heart rate, LVEDV and septal thickness set the simulator; "
        "all seven condition the posterior."
    )
    return Table(f"Context of each subject ({cohort_title}).", tuple(columns), body(rows), note)


def _context(context: Context) -> tuple[str, ...]:
    measured = [numbers.fixed(getattr(context, variable.name), variable.digits) for variable in MEASURED]
    cells = [context.subject, context.sex, *measured]
    cells.insert(EJECTED_AT, numbers.percent(1.0 - context.lvesv_ml / context.lvedv_ml, 0))
    return tuple(cells)


def recording_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return what quality control accepted and rejected of each recording, and why."""
    reasons = [
        reason
        for reason in observations[0].rejected
        if any(observation.rejected[reason] for observation in observations)
    ]
    columns = (
        Column("Subject", numeric=False),
        Column("Phases measured", "of recorded"),
        Column("Samples accepted", "of recorded"),
        *(Column(numbers.rejection(reason), "rejected") for reason in reasons),
        Column("Between repeats", "sd, % of speed"),
        Column("Within repeats", "sd, % of speed"),
        Column("Stiffness", "kPa, lowest to highest"),
    )
    rows = tuple(Row(_recording(observation, reasons)) for observation in observations)
    note = (
        "Each rejected sample counts once, for the first reason that applies. Stiffness is the range of the "
        "measured phases."
    )
    return Table(f"Recordings and quality control ({cohort_title}).", columns, rows, note)


def _recording(observation: Observation, reasons: Sequence[str]) -> tuple[str, ...]:
    accepted = int(observation.samples_accepted.sum())
    recorded = accepted + sum(observation.rejected.values())
    stiffness = observation.stiffness_kpa[observation.measured]
    return (
        observation.subject,
        f"{int(observation.measured.sum())} of {len(observation.phase)}",
        f"{numbers.count(accepted)} of {numbers.count(recorded)}",
        *(numbers.count(observation.rejected[reason]) for reason in reasons),
        numbers.percent(observation.noise.repeat_fraction),
        numbers.percent(observation.noise.sample_fraction),
        f"{numbers.fixed(float(stiffness.min()), 1)} to {numbers.fixed(float(stiffness.max()), 1)}",
    )


def verdict_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the outcome of both support criteria for each subject."""
    columns = (
        *words("Subject", "Verdict"),
        Column("Largest |z|"),
        *words("Attained by"),
        Column("Draws in bounds"),
        Column("Share in bounds", "%"),
        *(
            Column(f"Unfiltered {label}", numbers.PARAMETER_UNITS[name])
            for name, label in numbers.PARAMETERS.items()
        ),
    )
    rows = []
    for subject, verdict in experiment.verdicts.items():
        cells = (
            subject,
            verdict.status,
            numbers.fixed(verdict.max_abs_z, 2),
            numbers.component(verdict.worst_component),
            numbers.count(verdict.in_prior_draws),
            numbers.percent(verdict.acceptance),
            *(numbers.significant(verdict.unfiltered_median[name]) for name in numbers.PARAMETERS),
        )
        rows.append(Row(cells, muted=not verdict.may_be_read))
    required = experiment.settings["support"]
    least, of = (numbers.count(required[name]) for name in ("min_in_prior_draws", "candidate_draws"))
    note = (
        f"Required: |z| ≤ {required['max_abs_z']:g} in every component of the standardised feature-context "
        f"vector, and {least} of {of} candidate draws within the prior's bounds. Unfiltered: median of all "
        "candidates."
    )
    return Table(f"Does the prior support the subject? ({cohort_title})", columns, tuple(rows), note)


def score_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return table 1: the predictive scores of each subject, and their mean over those that pass."""
    first, second = (NOISY, NOISELESS) if experiment.exact else (NOISELESS, NOISY)
    columns = (
        Column("Subject", numeric=False),
        Column("RMSE, prior", "kPa"),
        Column("RMSE, posterior", "kPa"),
        Column("Reduction", "%"),
        Column("NRMSE"),
        Column("R²"),
        Column("Post-peak RMSE", "kPa"),
        Column(f"Coverage by {first.name}, grid", "%"),
        Column(f"Coverage by {first.name}, measured phases", "%"),
        Column("RMSE, CMA-ES", "kPa"),
        Column(f"Coverage by {second.name}, grid", "%"),
        Column(f"Coverage by {second.name}, measured phases", "%"),
        Column("Coverage by the prior's noiseless band, grid", "%"),
        Column("Coverage by the prior's envelope, grid", "%"),
    )
    strained = {name for name, verdict in experiment.verdicts.items() if verdict.status == STRAINED}
    rows = [_scores(row, second, str(row["subject"]) in strained) for row in records(experiment.scores)]
    mass = f"{experiment.predictive_percent:g} %"
    passed, left_out = PRIOR_SUPPORTED, "Subjects outside the prior's support have no posterior scores."
    if experiment.exact:
        passed = NOT_CONTRADICTED
        left_out = (
            "Contradicted subjects have no posterior scores; strained ones do, and are left out of the mean."
        )
    note = (
        "RMSE of the predictive median against the observed curve; reduction against the prior's. Coverage: "
        f"share of the observed curve inside the {mass} band of noiseless curves, or the {mass} interval of "
        f"new observations ({SPEED_NOISE if experiment.exact else FEATURE_NOISE}). The prior's band and "
        f"the extremes of all its draws are the ceiling of the first. {left_out}"
    )
    if len(experiment.passed) > 1:
        rows.append(_mean_scores(experiment.passed, second, passed))
    number = "" if experiment.exact else "Table 1. "
    caption = f"{number}Posterior predictive performance ({cohort_title})."
    return Table(caption, columns, tuple(rows), note)


def _scores(row: Mapping[Hashable, Any], second: CoverageReading, strained: bool) -> Row:
    cells = (
        str(row["subject"]),
        numbers.fixed(row["rmse_prior_kpa"], 2),
        numbers.fixed(row["rmse_kpa"], 2),
        numbers.fixed(row["rmse_reduction_percent"], 1),
        numbers.fixed(row["nrmse"], 3),
        numbers.fixed(row["r2"], 3),
        numbers.fixed(row["post_peak_rmse_kpa"], 2),
        numbers.percent(row["coverage_grid"], 0),
        numbers.percent(row["coverage_phases"], 0),
        numbers.fixed(row["rmse_cmaes_kpa"], 2),
        *(numbers.percent(row[name], 0) for name in (*second.columns, *CEILING)),
    )
    return Row(cells, muted=not row["may_be_read"], strained=strained)


def _mean_scores(scores: pd.DataFrame, second: CoverageReading, passed: str) -> Row:
    cells = (
        f"{passed}, mean ± sd",
        numbers.mean_sd(scores["rmse_prior_kpa"].to_numpy(), 2),
        numbers.mean_sd(scores["rmse_kpa"].to_numpy(), 2),
        numbers.mean_sd(scores["rmse_reduction_percent"].to_numpy(), 1),
        numbers.mean_sd(scores["nrmse"].to_numpy(), 3),
        numbers.mean_sd(scores["r2"].to_numpy(), 3),
        numbers.mean_sd(scores["post_peak_rmse_kpa"].to_numpy(), 2),
        numbers.mean_sd(100.0 * scores["coverage_grid"].to_numpy(), 0),
        numbers.mean_sd(100.0 * scores["coverage_phases"].to_numpy(), 0),
        numbers.mean_sd(scores["rmse_cmaes_kpa"].to_numpy(), 2),
        *(numbers.mean_sd(100.0 * scores[name].to_numpy(), 0) for name in (*second.columns, *CEILING)),
    )
    return Row(cells, summary=True)


def feature_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the checked features of each subject: observed, predicted, inside or not."""
    columns = (
        *words("Subject", "Feature", "Unit"),
        Column("Observed"),
        Column("Prior median"),
        Column("Posterior median"),
        Column("Posterior interval", f"{experiment.predictive_percent:g} %"),
        *words("Inside"),
    )
    rows = []
    for row in records(experiment.features):
        inside = (
            {True: "yes", False: "no"}.get(row["inside"], numbers.MISSING)
            if row["may_be_read"]
            else numbers.MISSING
        )
        cells = (
            str(row["subject"]),
            numbers.component(str(row["feature"])),
            numbers.feature_unit(str(row["feature"])),
            numbers.significant(row["observed"]),
            numbers.significant(row["prior_median"]),
            numbers.significant(row["median"]),
            numbers.span(numbers.significant(row["pi_low"]), numbers.significant(row["pi_high"])),
            inside,
        )
        rows.append(Row(cells, muted=not row["may_be_read"]))
    note = "Intervals are those of a new observation, the observation model's noise included."
    return Table(f"The features that carry noise ({cohort_title}).", columns, tuple(rows), note)


def posterior_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return medians, credible intervals and correlations of the three parameters."""
    columns = (
        *words("Subject", "Parameter", "Unit"),
        Column("Median"),
        Column("Credible interval", f"{experiment.credible_percent:g} %"),
        *(Column(f"Correlation with {label}") for label in numbers.PARAMETERS.values()),
        Column("Unfiltered median"),
        Column("CMA-ES"),
    )
    table = experiment.posterior
    rows = []
    for row in records(table[table["parameter"].isin(numbers.PARAMETERS)]):
        name = str(row["parameter"])
        correlations = [
            numbers.MISSING if other == name else numbers.fixed(row[f"correlation_{other}"], 2)
            for other in numbers.PARAMETERS
        ]
        cells = (
            str(row["subject"]),
            numbers.PARAMETERS[name],
            numbers.PARAMETER_UNITS[name],
            *numbers.estimate(row["median"], row["ci_low"], row["ci_high"]),
            *correlations,
            numbers.significant(row["unfiltered_median"]),
            numbers.significant(row["cmaes"]),
        )
        rows.append(Row(cells, muted=not row["may_be_read"]))
    note = "The unfiltered median is of all candidate draws, whether or not the prior allows them."
    return Table(f"Posterior of the three parameters ({cohort_title}).", columns, tuple(rows), note)


def derived_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return what a cardiologist reads: quantities of the posterior predictive simulations."""
    columns = (
        *words("Subject", "Quantity", "Unit"),
        Column("Median"),
        Column("Interval", f"{experiment.credible_percent:g} %"),
        Column("Measured"),
        *words("Beside it"),
    )
    table = experiment.posterior
    rows = []
    for row in records(table[~table["parameter"].isin(numbers.PARAMETERS) & table["may_be_read"]]):
        cells = (
            str(row["subject"]),
            numbers.quantity(str(row["parameter"])),
            DERIVED_UNITS.get(str(row["unit"]), str(row["unit"])),
            *_derived(row),
            numbers.significant(row["measured"]),
            beside_the_measured(row),
        )
        strained = experiment.verdicts[str(row["subject"])].status == STRAINED
        rows.append(Row(cells, strained=strained))
    note = (
        "From the simulations that the posterior draws give. The fit sees the "
        "stiffness curve alone; the measured volumes enter only as context. Beside it: whether the "
        "interval holds what was measured. Where it does not, the model's beat is not the subject's."
    )
    return Table(f"Derived quantities ({cohort_title}).", columns, tuple(rows), note)


def _derived(row: Mapping[Hashable, Any]) -> tuple[str, str]:
    most = DECIMALS.get(str(row["unit"]), 12)
    return numbers.estimate(row["median"], row["ci_low"], row["ci_high"], most_decimals=most)


def beside_the_measured(row: Mapping[Hashable, Any]) -> str:
    """Return in words how a derived quantity's interval lies to the measured; a dash where nothing was."""
    if pd.isna(row["measured"]) or pd.isna(row["median"]):
        return numbers.MISSING
    if row["ci_low"] <= row["measured"] <= row["ci_high"]:
        return "holds the measured"
    return "predicted above measured" if row["ci_low"] > row["measured"] else "predicted below measured"
