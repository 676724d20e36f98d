"""This study's values of what the paper prints: its design, support, scores, posteriors, recovery."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.parameters import THETA_NAMES
from swesbi.report.paper.values import (
    UNSUPPORTED,
    Findings,
    NoValueError,
    PaperNumber,
    StudyValue,
    differ,
    number,
    share,
    shown,
    spread,
)
from swesbi.verdict.summary import support_numbers
from swesbi.verdict.verdict import Verdict

EXCLUDED_CASES: Final = {"first": 0, "second": -1}
"""Places of the paper's two excluded cases among those of this study, by their max |z|."""


def designed(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return a number that the study was made with, by its dotted path; ``factor`` changes its unit."""
    path = asked.row.path
    value: Any = study.design
    for key in path.split("."):
        if not isinstance(value, Mapping) or key not in value:
            where = "cohort's recording.yaml" if path.startswith("protocol.") else "configuration"
            raise NoValueError(f"the {where} has no {path}")
        value = value[key]
    if isinstance(value, StudyValue):
        return value
    return number(float(value) * float(asked.row.of.get("factor", 1.0)), asked)


def supported_count(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return how many subjects the prior supports, and their names."""
    names = [name for name, verdict in study.verdicts.items() if verdict.may_be_read]
    return StudyValue(f"{len(names)} of {len(study.verdicts)}{_listed(names)}", len(names))


def excluded_count(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return how many subjects the prior does not support, and their names."""
    names = list(_excluded(study))
    return StudyValue(f"{len(names)}{_listed(names)}", len(names))


def excluded(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return a diagnostic of the first or the second excluded case.

    The paper has two. Its first has the smaller max |z|, its second the larger; so have those of this study.
    """
    cases = sorted(_excluded(study).items(), key=lambda item: item[1].max_abs_z)
    if len(cases) < len(EXCLUDED_CASES):
        raise NoValueError(f"subjects excluded: {len(cases)}, in the paper two")
    subject, verdict = cases[EXCLUDED_CASES[asked.option("which")]]
    what = asked.option("what")
    if what == "worst_component":
        is_named = verdict.worst_component.endswith(asked.option("ends"))
        return StudyValue(f"{asked.printed if is_named else verdict.worst_component} ({subject})")
    numbers = {"max_abs_z": verdict.max_abs_z, "in_prior_draws": float(verdict.in_prior_draws)}
    return number((numbers | verdict.unfiltered_median)[what], asked, f" ({subject})")


def score_mean(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return mean and sd of a score over the prior-supported subjects."""
    return spread(study.readable(study.ppc)[asked.option("column")].tolist(), asked)


def score(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return a score of the subject that bears the name of the paper's case."""
    own = study.ppc[(study.ppc["experiment"] == study.main) & (study.ppc["subject"] == asked.case)]
    if own.empty:
        raise NoValueError(f"the cohort has no subject {asked.case}")
    value = float(own[asked.option("column")].iloc[0])
    if math.isnan(value):
        why = ", ".join(support_numbers(study.verdicts[asked.case]))
        raise NoValueError(f"{asked.case} is not prior-supported: {why}")
    return number(value, asked)


def extreme_case(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return the prior-supported subject with the largest (or smallest) score, and that score."""
    values = study.readable(study.ppc)[asked.option("column")]
    if values.empty:
        raise NoValueError(UNSUPPORTED)
    name = str(values.idxmax() if asked.row.of["largest"] else values.idxmin())
    return StudyValue(f"{name} ({shown(float(values[name]), asked.row.digits)})")


def features_inside(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return in how many prior-supported subjects every checked feature is inside, and which do not."""
    table = study.readable(study.features)
    inside = table["inside"].astype(bool)
    outside = [f"{subject}: {feature}" for subject, feature in table.loc[~inside, "feature"].items()]
    complete = inside.groupby("subject", sort=False).all()
    counted = share(int(complete.sum()), len(complete))
    text = f"{int(inside.sum())} of {len(inside)}" + (f"; outside {', '.join(outside)}" if outside else "")
    return StudyValue(f"all in {counted.text} cases ({text})", counted.value, n=counted.n)


def peak_underestimated(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return in how many prior-supported subjects the prior predictive median of the maximum is too low."""
    table = study.readable(study.features[study.features["feature"] == "maximum_kpa"])
    return share(int((table["prior_median"] < table["observed"]).sum()), len(table))


def sbi_below_cmaes(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return in how many prior-supported subjects the posterior predictive median has the lower RMSE."""
    table = study.readable(study.ppc)
    return share(int((table["rmse_kpa"] < table["rmse_cmaes_kpa"]).sum()), len(table))


def correlation_mean(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return mean and sd of a posterior correlation over the prior-supported subjects."""
    table = study.parameter(asked.option("parameter"))
    return spread(table[f"correlation_{asked.option('other')}"].tolist(), asked)


def recovery_level(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return the nominal level of the recovery in percent."""
    levels = study.recoveries[study.main]["nominal"]
    if not (levels == asked.row.of["nominal"]).any():
        raise NoValueError(f"the recovery has no level {asked.row.of['nominal']:g}")
    return number(100.0 * float(asked.row.of["nominal"]), asked)


def recovery(study: Findings, asked: PaperNumber) -> StudyValue:
    """Return the coverage of a parameter in percent, with its binomial interval."""
    table = study.recoveries[study.main]
    row = table[
        (table["parameter"] == asked.option("parameter")) & (table["nominal"] == asked.row.of["nominal"])
    ]
    if row.empty:
        raise NoValueError("the recovery does not score it")
    low, value, high = (100.0 * float(row[name].iloc[0]) for name in ("ci_low", "coverage", "ci_high"))
    scored = int(row["n"].iloc[0])
    if not scored:
        raise NoValueError("no recording was scored")
    covered, *ends = (shown(each, asked.row.digits) for each in (value, low, high))
    return StudyValue(f"{covered} [{', '.join(ends)}], {scored} scored", value, n=scored)


def _excluded(study: Findings) -> dict[str, Verdict]:
    return {name: verdict for name, verdict in study.verdicts.items() if not verdict.may_be_read}


def _listed(names: list[str]) -> str:
    return f" ({', '.join(names)})" if names else ""


def scalar_only_degrades(study: Findings, asked: PaperNumber) -> StudyValue:
    """Say whether the mean RMSE is higher in the other experiment, over the subjects supported in both."""
    both = _beside(study, asked, lambda name: study.readable(study.ppc, name))
    means = both[["rmse_kpa", "rmse_kpa_other"]].mean().to_frame("mean").T
    worse = bool(means["rmse_kpa_other"].iloc[0] > means["rmse_kpa"].iloc[0])
    changes = _changes(pd.concat([means, both]), "rmse_kpa", asked)
    return StudyValue(f"{'yes' if worse else 'no'}: RMSE {changes} kPa")


def k_atp_shift(study: Findings, asked: PaperNumber) -> StudyValue:
    """Say whether the credible intervals of k_ATP are apart, over the subjects prior-supported in both."""
    both = _beside(study, asked, lambda name: study.parameter("k_atp_per_s", name))
    apart = (both["ci_low_other"] > both["ci_high"]) | (both["ci_high_other"] < both["ci_low"])
    return StudyValue(f"{_verdict(apart)}: median {_changes(both, 'median', asked)} 1/s")


def coverage_degrades(study: Findings, asked: PaperNumber) -> StudyValue:
    """Say whether a coverage of the other experiment is below nominal and lower, beyond binomial error."""
    nominal = float(asked.row.of["nominal"])
    both = _beside(
        study,
        asked,
        lambda name: _coverages(study.recoveries[name], nominal),
        "no recording was scored in both experiments",
    )
    rows = both[["coverage", "n", "coverage_other", "n_other"]].to_numpy()
    worse = any(row[2] < min(row[0], nominal) and differ(*map(float, row)) for row in rows)
    percent = both.assign(coverage=100 * both["coverage"], coverage_other=100 * both["coverage_other"])
    return StudyValue(f"{'yes' if worse else 'no'}: {_changes(percent, 'coverage', asked)} %")


def constraint_order(study: Findings, asked: PaperNumber) -> StudyValue:
    """Say whether k_0 has a narrower credible interval, relative to its median, than k_SR."""
    tables = [study.parameter(name) for name in THETA_NAMES]
    widths = [100.0 * float(((each["ci_high"] - each["ci_low"]) / each["median"]).mean()) for each in tables]
    if np.isnan(widths).any():
        raise NoValueError(UNSUPPORTED)
    named = ", ".join(
        f"{name} {shown(width, asked.row.digits)}" for name, width in zip(THETA_NAMES, widths, strict=True)
    )
    return StudyValue(f"{'yes' if widths[0] < widths[-1] else 'no'}: {named} % of the median")


def _beside(
    study: Findings,
    asked: PaperNumber,
    table: Callable[[str], pd.DataFrame],
    none: str = "no subject is prior-supported in both experiments",
) -> pd.DataFrame:
    """Return the rows that a table has in the main experiment and in the other (columns end in _other)."""
    experiment = asked.option("experiment")
    if experiment == study.main or experiment not in study.recoveries:
        raise NoValueError(f"the experiment '{experiment}' was not run beside '{study.main}'")
    main, other = table(study.main), table(experiment)
    both = main.merge(other, left_index=True, right_index=True, suffixes=("", "_other"))
    if both.empty:
        raise NoValueError(none)
    return both


def _verdict(holds: pd.Series) -> str:
    """Say of how many subjects a statement holds."""
    if holds.all():
        return "yes"
    return f"in {int(holds.sum())} of {len(holds)}" if holds.any() else "no"


def _changes(both: pd.DataFrame, column: str, asked: PaperNumber) -> str:
    """Name each row with its value in the main and in the other experiment."""
    values = zip(both.index, both[column].to_numpy(), both[f"{column}_other"].to_numpy(), strict=True)
    text = partial(shown, digits=asked.row.digits)
    return ", ".join(
        f"{name} {text(float(in_main))} → {text(float(in_other))}" for name, in_main, in_other in values
    )


def _coverages(recovery: pd.DataFrame, nominal: float) -> pd.DataFrame:
    return recovery[recovery["nominal"] == nominal].set_index("parameter")[["coverage", "n"]].dropna()
