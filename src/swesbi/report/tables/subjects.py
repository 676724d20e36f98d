"""Tables of the subjects: context, recording, verdict, predictive scores, features, posterior."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Final

import pandas as pd

from swesbi.context import CONTEXT
from swesbi.recording.observation import Observation
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    REJECTIONS,
    component,
    count,
    estimate,
    feature_unit,
    interval,
    middle,
    percent,
    quantity,
    yes_or_no,
)
from swesbi.report.results import Experiment
from swesbi.report.table import MARK, SUMMARY, Column, Table, words
from swesbi.verdict.verdict import Status

SUBJECT: Final = words("subject", "Subject")
UNIT: Final = words("parameter", "Unit", PARAMETER_UNITS)
PARAMETER: Final = words("parameter", "Parameter", PARAMETERS)
ESTIMATE: Final = ("median", "ci_low", "ci_high")
DECIMALS: Final = {"mL": 0, "kPa": 1, "1": 2}
"""By unit, what a scanner can tell of a derived quantity."""
DERIVED_UNITS: Final = {"1": "", "1/s": PARAMETER_UNITS["k_sr_per_s"]}
FEATURE_NOISE: Final = (
    "noise of Eq. 5 on the whole curve: that of the maximum as a scale, that of the time to peak as a shift"
)
SPEED_NOISE: Final = "noise of the measured speeds and discrepancy of the model"
SCORES: Final = (
    Column("rmse_prior_kpa", "RMSE, prior", "kPa", "2f"),
    Column("rmse_kpa", "RMSE, posterior", "kPa", "2f"),
    Column("rmse_reduction_percent", "Reduction", "%", "1f"),
    Column("nrmse", "NRMSE", "", "3f"),
    Column("r2", "R²", "", "3f"),
    Column("post_peak_rmse_kpa", "Post-peak RMSE", "kPa", "2f"),
    Column("coverage_noiseless_grid", "Coverage by noiseless curves, grid", "%", "0%"),
    Column("coverage_noiseless_phases", "Coverage by noiseless curves, measured phases", "%", "0%"),
    Column("rmse_cmaes_kpa", "RMSE, CMA-ES", "kPa", "2f"),
    Column("coverage_observed_grid", "Coverage by new observations, grid", "%", "0%"),
    Column("coverage_observed_phases", "Coverage by new observations, measured phases", "%", "0%"),
    Column("coverage_prior_band_grid", "Coverage by the prior's noiseless band, grid", "%", "0%"),
    Column("coverage_prior_envelope_grid", "Coverage by the prior's envelope, grid", "%", "0%"),
)
"""Table 1 of the paper, of ``ppc.csv``."""
POSTERIOR: Final = (
    SUBJECT,
    PARAMETER,
    UNIT,
    Column(ESTIMATE, "Median", "", middle),
    Column(ESTIMATE, "Credible interval", "", interval),
    *(
        Column(f"correlation_{name}", f"Correlation with {label}", "", "2f")
        for name, label in PARAMETERS.items()
    ),
    Column("unfiltered_median", "Unfiltered median", "", "3g"),
    Column("cmaes", "CMA-ES", "", "3g"),
)
"""The three parameters, of ``posterior.csv``."""
DERIVED: Final = (
    SUBJECT,
    words("parameter", "Quantity", quantity),
    words("unit", "Unit", DERIVED_UNITS),
    Column((*ESTIMATE, "unit"), "Median", "", lambda *values: _derived(*values)[0]),
    Column((*ESTIMATE, "unit"), "Interval", "", lambda *values: _derived(*values)[1]),
    Column("measured", "Measured", "", "3g"),
)
"""What follows from them, of ``posterior.csv``."""


def context_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return the context c_d of each subject; the ejection fraction is that of the measured volumes."""
    measured = [
        Column(each.name, each.words[0].upper() + each.words[1:], each.shown_unit, f"{each.digits}f")
        for each in CONTEXT[1:]
    ]
    volumes = ("lvedv_ml", "lvesv_ml")
    ejected = Column(volumes, "Ejection fraction", "%", lambda lvedv, lvesv: percent(1.0 - lvesv / lvedv, 0))
    behind = 1 + [column.source for column in measured].index(volumes[-1])
    note = (
        "LVEDV, LVESV: left ventricular end-diastolic and end-systolic volume; septal thickness at "
        "end diastole. Heart rate, LVEDV and septal thickness set the simulator; "
        "all seven condition the posterior."
    )
    return Table(
        f"Context of each subject ({cohort_title}).",
        pd.DataFrame([vars(observation.context) for observation in observations]),
        (SUBJECT, words("sex", "Sex"), *measured[:behind], ejected, *measured[behind:]),
        note,
    )


def recording_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return what quality control accepted and rejected of each recording, and why."""
    frame = pd.DataFrame([_recording(observation) for observation in observations])
    columns = (
        SUBJECT,
        Column(("measured", "phases"), "Phases measured", "of recorded", "{} of {}".format),
        Column(
            ("accepted", "recorded"),
            "Samples accepted",
            "of recorded",
            lambda accepted, recorded: f"{count(accepted)} of {count(recorded)}",
        ),
        *(
            Column(reason, REJECTIONS[reason], "rejected", "d")
            for reason in observations[0].rejected
            if frame[reason].any()
        ),
        Column("between", "Between repeats", "sd, % of speed", "1%"),
        Column("within", "Within repeats", "sd, % of speed", "1%"),
        Column(("lowest", "highest"), "Stiffness", "kPa, lowest to highest", "1f"),
    )
    note = (
        "Each rejected sample counts once, for the first reason that applies. Stiffness is the range of the "
        "measured phases."
    )
    return Table(f"Recordings and quality control ({cohort_title}).", frame, columns, note)


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
    columns = (
        SUBJECT,
        words("status", "Verdict"),
        Column("max_abs_z", "Largest |z|", "", "2f"),
        words("worst_component", "Attained by", component),
        Column("in_prior_draws", "Draws in bounds", "", "d"),
        Column("acceptance", "Share in bounds", "%", "1%"),
        *(
            Column(name, f"Unfiltered {label}", PARAMETER_UNITS[name], "3g")
            for name, label in PARAMETERS.items()
        ),
    )
    rows = [
        {"subject": name, "acceptance": verdict.acceptance, **vars(verdict), **verdict.unfiltered_median}
        for name, verdict in experiment.verdicts.items()
    ]
    required = experiment.settings["support"]
    least, of = (count(required[name]) for name in ("min_in_prior_draws", "candidate_draws"))
    note = (
        f"Required: |z| ≤ {required['max_abs_z']:g} in every component of the standardised feature-context "
        f"vector, and {least} of {of} candidate draws within the prior's bounds. Unfiltered: median of all "
        "candidates."
    )
    caption = f"Does the prior support the subject? ({cohort_title})"
    return Table(caption, experiment.marked(pd.DataFrame(rows)), columns, note)


def score_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return table 1: the predictive scores of each subject, and their mean over those that pass."""
    mass = f"{experiment.predictive_percent:g} %"
    passed, left_out = (
        Status.PRIOR_SUPPORTED,
        "Subjects outside the prior's support have no posterior scores.",
    )
    if experiment.exact:
        passed = Status.NOT_CONTRADICTED
        left_out = (
            "Contradicted subjects have no posterior scores; doubtful ones do, and are left out of the mean."
        )
    note = (
        "RMSE of the predictive median against the observed curve; reduction against the prior's. Coverage: "
        f"share of the observed curve inside the {mass} band of noiseless curves, or the {mass} interval of "
        f"new observations ({SPEED_NOISE if experiment.exact else FEATURE_NOISE}). The prior's band and "
        f"the extremes of all its draws are the ceiling of the first. {left_out}"
    )
    frame = with_mean(experiment.marked(experiment.scores), experiment.passed, f"{passed}, ")
    number = "" if experiment.exact else "Table 1. "
    caption = f"{number}Posterior predictive performance ({cohort_title})."
    return Table(caption, frame, (SUBJECT, *SCORES), note)


def with_mean(scores: pd.DataFrame, passed: pd.DataFrame, label: str = "") -> pd.DataFrame:
    """Return scores with two rows more where several pass: mean and standard deviation of those."""
    if len(passed) < 2:
        return scores
    numbers = passed[[str(column.source) for column in SCORES]]
    mean = {"subject": f"{label}mean", MARK: SUMMARY, **numbers.mean()}
    spread = {"subject": f"{label}sd", MARK: SUMMARY, **numbers.std(ddof=1)}
    return pd.concat([scores, pd.DataFrame([mean, spread])])


def feature_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the checked features of each subject: observed, predicted, inside or not."""
    columns = (
        SUBJECT,
        words("feature", "Feature", component),
        words("feature", "Unit", feature_unit),
        Column("observed", "Observed", "", "3g"),
        Column("prior_median", "Prior median", "", "3g"),
        Column("median", "Posterior median", "", "3g"),
        Column(("pi_low", "pi_high"), "Posterior interval", f"{experiment.predictive_percent:g} %", "3g"),
        words("inside", "Inside", yes_or_no),
    )
    note = "Intervals are those of a new observation, the observation model's noise included."
    caption = f"The features that carry noise ({cohort_title})."
    return Table(caption, experiment.marked(experiment.features), columns, note)


def posterior_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return medians, credible intervals and correlations of the three parameters."""
    table = parameters_of(experiment.posterior)
    mass = f"{experiment.credible_percent:g} %"
    note = (
        f"Intervals: {mass}. The unfiltered median is of all candidate draws, whether or not the prior "
        "allows them."
    )
    caption = f"Posterior of the three parameters ({cohort_title})."
    return Table(caption, experiment.marked(table), POSTERIOR, note)


def parameters_of(posterior: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the three parameters, without the correlation of each with itself."""
    table = posterior[posterior["parameter"].isin(PARAMETERS)]
    others = {f"correlation_{name}": table["parameter"] != name for name in PARAMETERS}
    return table.assign(**{column: table[column].where(other) for column, other in others.items()})


def derived_of(posterior: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of what follows from the parameters, of subjects that may be interpreted."""
    return posterior[~posterior["parameter"].isin(PARAMETERS) & posterior["may_be_read"]]


def derived_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return what a cardiologist reads: quantities of the posterior predictive simulations."""
    table = derived_of(experiment.posterior)
    beside = [beside_the_measured(row) for row in table.to_dict("records")]
    note = (
        f"Intervals: {experiment.credible_percent:g} %. From the simulations that the posterior draws give. "
        "The fit sees the stiffness curve alone; the measured volumes enter only as context. Beside it: "
        "whether the interval holds what was measured. Where it does not, the model's beat is not the "
        "subject's."
    )
    frame = experiment.marked(table.assign(beside=beside))
    columns = (*DERIVED, words("beside", "Beside it"))
    return Table(f"Derived quantities ({cohort_title}).", frame, columns, note)


def _derived(median: float, low: float, high: float, unit: str) -> tuple[str, str]:
    return estimate(median, low, high, most_decimals=DECIMALS.get(unit, 12))


def beside_the_measured(row: Mapping[Hashable, Any]) -> str:
    """Return in words how a derived quantity's interval lies to the measured; a dash where nothing was."""
    if pd.isna(row["measured"]) or pd.isna(row["median"]):
        return MISSING
    if row["ci_low"] <= row["measured"] <= row["ci_high"]:
        return "holds the measured"
    return "predicted above measured" if row["ci_low"] > row["measured"] else "predicted below measured"
