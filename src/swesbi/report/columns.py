"""Every column of a shown table, once: what it takes of the rows, its heading, its unit and its digits.

Tables name their columns. Only one whose heading the study gives (a subject, an experiment) is made there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from swesbi.context import CONTEXT
from swesbi.parameters import NUISANCES, QUANTITIES
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    QUANTITY_WORDS,
    REJECTIONS,
    component,
    count,
    feature_unit,
    fixed,
    interval,
    middle,
    percent,
    quantity,
    with_limits,
    with_minus,
    yes_or_no,
)
from swesbi.report.paper.values import DESIGNED
from swesbi.report.results import columns_of
from swesbi.report.table import Column, words
from swesbi.verdict.summary import ANSWERS, LIMITS, RECORDINGS

COVERAGE: Final = ("coverage", "ci_low", "ci_high")
ACQUIRED: Final = "_acquired"
"""Ends what is of recordings with the noise of an acquisition."""
SAMPLER_NAMES: Final = {"importance": "importance weights", "mcmc": "MCMC"}
DESIGN_MARK: Final = "†"
MEANINGS: Final = {parameter.name: parameter.meaning for parameter in NUISANCES}


def named(*names: str | Column) -> tuple[Column, ...]:
    """Return columns by their names; one that is given itself passes."""
    return tuple(COLUMNS[name] if isinstance(name, str) else name for name in names)


def each_parameter(kind: str, of: Iterable[str] = PARAMETERS) -> tuple[str, ...]:
    """Return the names of the columns of a kind: "answer" as "answer k0_kpa", ..."""
    return tuple(f"{kind} {name}" for name in of)


def _sampler(name: str, converged: Any) -> str:  # noqa: ANN401
    return SAMPLER_NAMES[name] if converged else f"{SAMPLER_NAMES[name]}, not converged"


def _origin(origin: str) -> str:
    """Return where a number comes from, with a mark where it is designed."""
    return f"{DESIGN_MARK} {origin}" if origin.startswith(DESIGNED) else origin


def _correlated(name: str, correlation: float) -> str:
    return f"{MEANINGS.get(name) or quantity(name)} ({fixed(correlation, 2)})"


def _of_all(some: int, recorded: int) -> str:
    return f"{count(some)} of {count(recorded)}"


_BY_SOURCE: Final = (
    # whose it is
    words("subject", "Subject"),
    words("sex", "Sex"),
    *(
        Column(each.name, each.words[0].upper() + each.words[1:], each.shown_unit, f"{each.digits}f")
        for each in CONTEXT[1:]
    ),
    words("experiment", "Experiment"),
    words("parameter", "Parameter", QUANTITY_WORDS),
    words("quantity", "Quantity", quantity),
    words("feature", "Feature", component),
    # what was recorded
    *(Column(reason, head, "rejected", "d") for reason, head in REJECTIONS.items()),
    Column("between", "Between repeats", "sd, % of speed", "1%"),
    Column("within", "Within repeats", "sd, % of speed", "1%"),
    words("component", "Component"),
    Column("fraction", "Size", "% of the speed", "2%"),
    Column("standard_error", "Standard error", "", "2%"),
    # verdicts
    words("status", "Verdict"),
    words("against", "Tests that speak against it"),
    words("reason", "Tests that contradict the model", {"": MISSING}),
    words("reasons", "Commonest reasons"),
    words("limits", "What limits them"),
    words("test", "Test"),
    Column("statistic", "Statistic", "", "3g"),
    Column("p_value", "p-value", "", "2g"),
    Column("limit", "Limit", "", "2g"),
    Column("max_abs_z", "Largest |z|", "", "2f"),
    words("worst_component", "Attained by", component),
    Column("in_prior_draws", "Draws in bounds", "", "d"),
    Column("acceptance", "Share in bounds", "%", "1%"),
    Column("subjects", "Subjects", "", "d"),
    Column("share", "Share", "%", "1%"),
    # how draws were made
    words("sampler", "Draws by", SAMPLER_NAMES),
    Column("k_hat", "k-hat", "", "2f"),
    Column("efficiency", "Efficiency", "%", "0%"),
    Column("median_efficiency", "Median efficiency", "%", "0%"),
    Column("r_hat", "R-hat", "", "3f"),
    words("converged", "Sampler converged", yes_or_no),
    # posteriors
    Column("unfiltered_median", "Unfiltered median", "", "3g"),
    Column("network", "Median, network alone", "", "3g"),
    Column("cmaes", "CMA-ES", "", "3g"),
    Column("measured", "Measured", "", "3g"),
    words("beside", "Beside it"),
    Column("truth", "Truth", "", "3g"),
    words("inside", "Inside", yes_or_no),
    # predictive checks: table 1 of the paper, then features
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
    Column("observed", "Observed", "", "3g"),
    Column("prior_median", "Prior median", "", "3g"),
    # recovery of known parameters, and training
    words("recordings", "Recordings", RECORDINGS),
    Column("pooled", "Checks, pooled", "failed of all"),
    Column("single", "Checks, by subject", "failed of all"),
    *(Column(f"sbc {name}", f"Coverage of {word}", "%, pooled", "1%") for name, word in PARAMETERS.items()),
    Column("tarp joint", "Joint coverage", "%, pooled", "1%"),
    Column("nominal", "Nominal", "%", "0%"),
    Column("n", "Recordings", "", "d"),
    Column(f"n{ACQUIRED}", "Recordings", "", "d"),
    Column("bias", "Bias", "own noise", "2f"),
    Column(f"bias{ACQUIRED}", "Bias", "acquisition", "2f"),
    Column("contraction", "Contraction", "own noise", "3f"),
    Column("epochs", "Epochs trained", "", "d"),
    Column("epoch", "Epoch of the lowest validation loss", "", "d"),
    Column("validation_loss", "Lowest validation loss", "", "2f"),
    Column("training_loss", "Training loss there", "", "2f"),
    Column("last", "Validation loss at the end", "", "2f"),
    # what a recording tells
    Column("contraction_log", "Contraction", "log scale", "3f"),
    Column("sensitivity_prior", "Sensitivity to the prior", "", "2f"),
    Column("sensitivity_nuisances", "to that of nuisance parameters", "", "2f"),
    Column("sensitivity_likelihood", "to the likelihood", "", "2f"),
    Column("sd_log", "Posterior sd", "% of the value", "1%"),
    Column("expected_sd_log", "Expected sd", "% of the value", "1%"),
    Column("width_4", "With four times the repeats", "% of the sd", "0%"),
    # pressures
    Column("width_ratio", "Width with over without", "median (least to largest)"),
    Column("shift_in_widths", "Shift", "widths, median (least to largest)"),
    # a cohort, and every subject within it
    words("verdict", "Verdict"),
    Column("probability_above_1", "Above 1", "%", "0%"),
    Column("outlier_probability", "Outlier", "%", "0%"),
    # the paper
    words("statement", "Statement"),
    words("paper", "Paper", with_minus),
    words("this_study", "This study", with_minus),
    words("agrees", "Agrees"),
    words("note", "Reading"),
    words("origin", "Designed or found", _origin),
    words("measure", "Mean ± sd over prior-supported subjects"),
)
_OF_SEVERAL: Final = {
    "unit": words("parameter", "Unit", {name: each.html_unit for name, each in QUANTITIES.items()}),
    "feature_unit": words("feature", "Unit", feature_unit),
    "answer": words("sampler", "Answer", ANSWERS),
    "printed": words("quantity", "Quantity"),
    "median": Column(LIMITS, "Median", "", middle),
    "interval": Column(LIMITS, "Credible interval", "", interval),
    "predicted_median": Column("median", "Posterior median", "", "3g"),
    "predicted_interval": Column(("pi_low", "pi_high"), "Posterior interval", "", "3g"),
    "derived": words("parameter", "Quantity", quantity),
    "derived_unit": words("unit", "Unit", {"1": "", "1/s": PARAMETER_UNITS["k_sr_per_s"]}),
    "derived_median": Column((*LIMITS, "unit"), "Median", "", middle),
    "derived_interval": Column((*LIMITS, "unit"), "Interval", "", interval),
    "ejection": Column(
        ("lvedv_ml", "lvesv_ml"),
        "Ejection fraction",
        "%",
        lambda lvedv, lvesv: percent(1.0 - lvesv / lvedv, 0),
    ),
    "phases": Column(("measured", "phases"), "Phases measured", "of recorded", _of_all),
    "samples": Column(("accepted", "recorded"), "Samples accepted", "of recorded", _of_all),
    "stiffness": Column(("lowest", "highest"), "Stiffness", "kPa, lowest to highest", "1f"),
    "size_interval": Column(("low", "high"), "Interval", "", "2%"),
    "coverage": Column(COVERAGE, "Coverage, own noise", "% (interval)", "1%"),
    "coverage_acquired": Column(
        tuple(f"{name}{ACQUIRED}" for name in COVERAGE), "Coverage, acquisition noise", "% (interval)", "1%"
    ),
    "hyperparameter": words(
        ("quantity", "of"),
        "Quantity",
        lambda name, of: name if of == "all" else f"{name}: {of.replace('_', ' ')}",
    ),
    "hyperparameter_interval": Column(LIMITS, "Interval", "", interval),
    "hyperparameter_unit": words(
        ("parameter", "unit"), "Unit", lambda name, unit: "" if unit == "1" else PARAMETER_UNITS[name]
    ),
    "draws_behind": Column(
        ("effective_draws", "refreshed"),
        "Draws",
        "",
        lambda draws, refreshed: f"{draws:.0f}*" if refreshed else f"{draws:.0f}",
    ),
    "checked": Column("n", "n", "", "d"),
    "correlated": Column(("correlated_with", "correlation"), "Correlated most with", "", _correlated),
    "cuff": Column(("sbp_mmhg", "dbp_mmhg"), "Cuff", "mmHg", "{:.0f} / {:.0f}".format),
    "pressures_sampler": words(("sampler", "converged"), "Draws by", _sampler),
}
_OF_QUANTITIES: Final = {
    f"{kind} {name}": column
    for name, each in QUANTITIES.items()
    for word in [quantity(name)]
    for kind, column in (
        ("answer", Column(columns_of(name), word, each.html_unit, with_limits)),
        (
            "alone",
            Column(columns_of(f"{name}_alone"), f"{word} alone", f"{each.html_unit} (interval)", with_limits),
        ),
        ("within", Column(columns_of(name), f"{word} within", f"{each.html_unit} (interval)", with_limits)),
        ("coverage", Column(columns_of(name, COVERAGE), f"Coverage of {word}", "% (interval)", "1%")),
        ("correlation", Column(f"correlation_{name}", f"Correlation with {word}", "", "2f")),
        ("unfiltered", Column(name, f"Unfiltered {word}", each.html_unit, "3g")),
        ("width", Column(f"{name}_width_ratio", f"Width of {word}", "with over without", "2f")),
        ("with", Column(columns_of(f"{name}_with"), word, "median (interval)", "2f")),
    )
}
"""Columns that there are of each quantity: "answer k0_kpa", its median and interval, ..."""
COLUMNS: Final[Mapping[str, Column]] = {
    **{str(column.source): column for column in _BY_SOURCE},
    **_OF_SEVERAL,
    **_OF_QUANTITIES,
}
"""By name: that of the column of the rows, or another where it is of several or of none alone."""
