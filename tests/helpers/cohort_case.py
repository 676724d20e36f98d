"""A cohort of any size, answered or refused, for the tests of what shows it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from swesbi.context import Context
from swesbi.parameters import REPORTED_NAMES, THETA_NAMES
from swesbi.verdict.summary import AnswerSummary, cohort_table

TITLE = "virtual volunteers"
REASON = "ivsd_cm = 1.5 is outside [0.4, 1.4]"
VERDICTS = (("not contradicted", ""), ("doubtful", "χ²"), ("contradicted", "χ²; mass at a bound"))
MEDIANS = {"k0_kpa": 40.0, "k_atp_per_s": 6.0, "k_sr_per_s": 25.0, "passive_stiffness_kpa": 2.0}
STRATA = ("all", "sex F", "age_years below 18", "hr_bpm 67 to 80", "relative_se 0.0351 and more")


def context(number: int) -> Context:
    return Context(
        f"S{number:03d}", "F", 20.0 + number % 60, 1.7, 60.0 + number % 40, 80.0 + number % 50, 30.0, 0.8
    )


def answer(number: int) -> AnswerSummary:
    verdict, reason = VERDICTS[number % 3]
    median = np.array([MEDIANS.get(name, 50.0) for name in REPORTED_NAMES]) * (1.0 + 0.01 * (number % 70))
    limits = np.stack([median, 0.8 * median, 1.3 * median], axis=1)
    sampler = "mcmc" if number % 9 == 0 else "importance"
    return AnswerSummary(verdict, reason, limits, 0.9, 0.4, (number % 10) / 10.0, sampler)


def table(subjects: int, refused: int) -> pd.DataFrame:
    """Return a cohort whose last subjects are refused."""
    contexts = [context(number) for number in range(subjects)]
    answers = {one.subject: answer(number) for number, one in enumerate(contexts[: subjects - refused])}
    return cohort_table(contexts, answers, {one.subject: REASON for one in contexts[subjects - refused :]})


def strata() -> pd.DataFrame:
    rows = [
        {"sampler": sampler, "stratum": stratum, "parameter": name, "nominal": nominal, "coverage": nominal,
         "ci_low": nominal - 0.03, "ci_high": nominal + 0.02, "n": 400, "bias": 0.0, "contraction": 0.5,
         "median_efficiency": 0.6}
        for sampler in ("proposal", "weighted")
        for stratum in STRATA
        for name in THETA_NAMES
        for nominal in (0.5, 0.9)
    ]  # fmt: skip
    return pd.DataFrame(rows)
