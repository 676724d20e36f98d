"""Calibration of an experiment on speeds, and the alarms of its misspecification tests."""

from __future__ import annotations

from typing import Final

import pandas as pd

from swesbi.checks.calibration.alarms import ALARMS
from swesbi.checks.calibration.table import C2ST, POOLED
from swesbi.report.columns import COLUMNS, named
from swesbi.report.numbers import MISSING, PARAMETERS, count, fixed
from swesbi.report.results import Experiment, wide
from swesbi.report.table import Column, Table, words
from swesbi.verdict.summary import RECORDINGS

MADE = words("recordings", "Recordings", RECORDINGS)

CLOPPER_PEARSON: Final = "Clopper-Pearson, as calibration.judgement.confidence says"


def calibration_summary(exact: Experiment) -> Table:
    """Return how many checks of calibration fail, by how recordings were made and who answered."""
    columns = (
        MADE,
        COLUMNS["answer"],
        Column("pooled", "Checks, pooled", "failed of all"),
        Column("single", "Checks, by subject", "failed of all"),
        *(
            Column(f"sbc {name}", f"Coverage of {label}", "%, pooled", "1%")
            for name, label in PARAMETERS.items()
        ),
        Column("tarp joint", "Joint coverage", "%, pooled", "1%"),
        COLUMNS["n"],
    )
    table = exact.calibration
    rows = []
    for key, part in table[table["test"] != C2ST].groupby(["recordings", "sampler"], sort=False):
        of_all = part["subject"] == POOLED
        known = part[of_all].dropna(subset="coverage_90")
        covered = dict(zip(known["test"] + " " + known["quantity"], known["coverage_90"], strict=True))
        failed = {"pooled": _failed(part[of_all]), "single": _failed(part[~of_all]), "n": part["n"].max()}
        rows.append(dict(zip(("recordings", "sampler"), key, strict=True)) | failed | covered)
    note = (
        "Checks: ranks of the truth and coverage at all levels within simultaneous bands, joint coverage, "
        "contraction. Coverage is that of 90 % intervals and regions. At the subject's own data, the truth "
        f"is a draw of its posterior and the recording a new one from it. {two_samples(table)}"
    )
    return Table("Calibration on recordings of known parameters.", pd.DataFrame(rows), columns, note)


def _failed(table: pd.DataFrame) -> str:
    return f"{int(table['flagged'].sum())} of {len(table)}" if len(table) else MISSING


def failed_checks(exact: Experiment) -> Table:
    """Return the checks that failed."""
    columns = (
        COLUMNS["subject"],
        MADE,
        COLUMNS["answer"],
        *named("test", "quantity"),
        Column("n", "n", "", "d"),
        Column("statistic", "Statistic", "", "3g"),
        Column("p_value", "p-value", "", "2g"),
        Column("limit", "Limit", "", "2g"),
    )
    table = exact.calibration
    note = f"All {count(len(table))} checks: calibration.csv in the folder of the experiment."
    return Table("Checks of calibration that failed.", table[table["flagged"] == 1], columns, note)


def alarms_table(exact: Experiment) -> Table:
    """Return how often the verdict raises an alarm on recordings that the model itself made."""
    columns = (
        MADE,
        *(
            Column(tuple(f"{name}_{of}" for of in ("rate", "ci_low", "ci_high")), name, "% (interval)", "1%")
            for name in ALARMS
        ),
        COLUMNS["n"],
    )
    table = exact.alarms
    frame = wide(table[table["alarm"].isin(ALARMS)], ["recordings"], "alarm")
    note = f"On recordings that the model itself made an alarm is false. Intervals: {CLOPPER_PEARSON}."
    return Table("False alarms of the misspecification tests.", frame, columns, note)


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
