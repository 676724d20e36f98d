"""What the paper says of further experiments without printing a number, judged by numbers here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd

from swesbi.comparison.binomial import differ
from swesbi.comparison.measured import Asked, Measure, Measured, absent, shown
from swesbi.comparison.results import StudyResults
from swesbi.parameters import THETA_NAMES


def scalar_only_degrades(study: StudyResults, asked: Asked) -> Measured:
    """Say whether the RMSE is higher in the other experiment, over the subjects supported in both."""
    if missing := _not_run(study, asked):
        return missing
    both = _beside(study.scores(), study.scores(asked.option("experiment")))
    if both.empty:
        return absent("no subject is supported in both experiments")
    worse = both["rmse_kpa_other"] > both["rmse_kpa"]
    return Measured(f"{_verdict(worse)}: RMSE {_changes(both, 'rmse_kpa', asked)} kPa")


def k_atp_shift(study: StudyResults, asked: Asked) -> Measured:
    """Say whether the credible intervals of k_ATP are apart, over the subjects supported in both."""
    if missing := _not_run(study, asked):
        return missing
    main, other = (study.parameter("k_atp_per_s", name) for name in (study.main, asked.option("experiment")))
    both = _beside(main, other)
    if both.empty:
        return absent("no subject is supported in both experiments")
    apart = (both["ci_low_other"] > both["ci_high"]) | (both["ci_high_other"] < both["ci_low"])
    return Measured(f"{_verdict(apart)}: median {_changes(both, 'median', asked)} 1/s")


def coverage_degrades(study: StudyResults, asked: Asked) -> Measured:
    """Say whether the recovery covers less in the other experiment, beyond binomial error."""
    if missing := _not_run(study, asked):
        return missing
    main, other = (
        _coverages(study.recoveries[name], float(asked.of["nominal"]))
        for name in (study.main, asked.option("experiment"))
    )
    both = _beside(main, other).dropna()
    if both.empty:
        return absent("no recording was scored in both experiments")
    rows = both[["coverage", "n", "coverage_other", "n_other"]].to_numpy()
    less = any(row[2] < row[0] and differ(*map(float, row)) for row in rows)
    percent = both.assign(coverage=100 * both["coverage"], coverage_other=100 * both["coverage_other"])
    return Measured(f"{'yes' if less else 'no'}: {_changes(percent, 'coverage', asked)} %")


def constraint_order(study: StudyResults, asked: Asked) -> Measured:
    """Say whether k_0 has a narrower credible interval, relative to its median, than k_SR."""
    widths = []
    for name in THETA_NAMES:
        table = study.parameter(name)
        widths.append(100.0 * float(((table["ci_high"] - table["ci_low"]) / table["median"]).mean()))
    if np.isnan(widths).any():
        return absent("no subject is supported")
    named = ", ".join(
        f"{name} {shown(width, asked.digits)}" for name, width in zip(THETA_NAMES, widths, strict=True)
    )
    return Measured(f"{'yes' if widths[0] < widths[-1] else 'no'}: {named} % of the median")


def _not_run(study: StudyResults, asked: Asked) -> Measured | None:
    experiment = asked.option("experiment")
    if experiment == study.main or experiment not in study.recoveries:
        return absent(f"the experiment '{experiment}' was not run beside '{study.main}'")
    return None


def _beside(main: pd.DataFrame, other: pd.DataFrame) -> pd.DataFrame:
    """Put two tables beside each other, of the rows that both have; the other's columns end in _other."""
    return main.merge(other, left_index=True, right_index=True, suffixes=("", "_other"))


def _verdict(holds: pd.Series) -> str:
    """Say of how many subjects a statement holds."""
    if holds.all():
        return "yes"
    return f"in {int(holds.sum())} of {len(holds)}" if holds.any() else "no"


def _changes(both: pd.DataFrame, column: str, asked: Asked) -> str:
    """Name each row with its value in the main and in the other experiment."""
    values = zip(both.index, both[column].to_numpy(), both[f"{column}_other"].to_numpy(), strict=True)
    return ", ".join(
        f"{name} {shown(float(one), asked.digits)} → {shown(float(other), asked.digits)}"
        for name, one, other in values
    )


def _coverages(recovery: pd.DataFrame, nominal: float) -> pd.DataFrame:
    table: pd.DataFrame = recovery[recovery["nominal"] == nominal].set_index("parameter")[["coverage", "n"]]
    return table


MEASURES: Final[Mapping[str, Measure]] = {
    function.__name__: function
    for function in (scalar_only_degrades, k_atp_shift, coverage_degrades, constraint_order)
}
