"""Calibration of an experiment on speeds, and the alarms of its misspecification tests."""

from __future__ import annotations

from typing import Final

import pandas as pd

from swesbi.checks.calibration.table import ALARMS, C2ST, POOLED
from swesbi.report.columns import each_parameter, named
from swesbi.report.numbers import MISSING, count, fixed
from swesbi.report.results import Experiment, columns_of, wide
from swesbi.report.table import Column, Table

CLOPPER_PEARSON: Final = "Clopper-Pearson, as calibration.judgement.confidence says"


def calibration_summary(exact: Experiment) -> Table:
    """Return how many checks of calibration fail, by how recordings were made and who answered."""
    table = exact.calibration
    rows = []
    for key, part in table[table["test"] != C2ST].groupby(["recordings", "sampler"], sort=False):
        of_all = part["subject"] == POOLED
        known = part[of_all].dropna(subset="coverage_90")
        covered = dict(zip(known["test"] + " " + known["quantity"], known["coverage_90"], strict=True))
        failed = {"pooled": _failed(part[of_all]), "single": _failed(part[~of_all]), "n": part["n"].max()}
        rows.append(dict(zip(("recordings", "sampler"), key, strict=True)) | failed | covered)
    return Table(
        "Calibration on recordings of known parameters.",
        pd.DataFrame(rows),
        named("recordings", "answer", "pooled", "single", *each_parameter("sbc"), "tarp joint", "n"),
        "Checks: ranks of the truth and coverage at all levels within simultaneous bands, joint coverage, "
        "contraction. Coverage is that of 90 % intervals and regions. At the subject's own data, the truth "
        f"is a draw of its posterior and the recording a new one from it. {two_samples(table)}",
    )


def _failed(table: pd.DataFrame) -> str:
    return f"{int(table['flagged'].sum())} of {len(table)}" if len(table) else MISSING


def failed_checks(exact: Experiment) -> Table:
    """Return the checks that failed."""
    table, of_each = exact.calibration, ("checked", "statistic", "p_value", "limit")
    return Table(
        "Checks of calibration that failed.",
        table[table["flagged"] == 1],
        named("subject", "recordings", "answer", "test", "quantity", *of_each),
        f"All {count(len(table))} checks: calibration.csv in the folder of the experiment.",
    )


def alarms_table(exact: Experiment) -> Table:
    """Return how often the verdict raises an alarm on recordings that the model itself made."""
    alarms = (
        Column(columns_of(name, ("rate", "ci_low", "ci_high")), name, "% (interval)", "1%") for name in ALARMS
    )
    frame = wide(exact.alarms[exact.alarms["alarm"].isin(ALARMS)], ["recordings"], "alarm")
    return Table(
        "False alarms of the misspecification tests.",
        frame,
        named("recordings", *alarms, "n"),
        f"On recordings that the model itself made an alarm is false. Intervals: {CLOPPER_PEARSON}.",
    )


def two_samples(calibration: pd.DataFrame) -> str:
    """Say how well a classifier tells samplers apart."""
    accuracies = calibration[calibration["test"] == C2ST]
    if accuracies.empty:
        return "No samplers were compared."
    pairs = [
        f"{pair}: {fixed(part['statistic'].min(), 3)} to {fixed(part['statistic'].max(), 3)}"
        for pair, part in accuracies.groupby("sampler", sort=False)
    ]
    return f"Accuracy of a classifier that tells two samplers apart (0.5: it cannot), {'; '.join(pairs)}."
