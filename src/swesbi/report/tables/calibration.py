"""Calibration of an experiment on speeds, and the alarms of its misspecification tests."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any, Final

import pandas as pd

from swesbi.report.numbers import MISSING, PARAMETERS, count, fixed, percent, quantity, significant, span
from swesbi.report.results import records
from swesbi.report.table import Column, Row, Strong, Table, words
from swesbi.report.tables.exact import Exact
from swesbi.verdict.answers import ALARMS, ANSWERS, POOLED, RECORDINGS

ALL_SUBJECTS: Final = "all"


def calibration_summary(exact: Exact) -> Table:
    """Return how many checks of calibration fail, by how recordings were made and who answered."""
    columns = (
        *words("Recordings", "Answer"),
        Column("Checks, pooled", "failed of all"),
        Column("Checks, by subject", "failed of all"),
        *(Column(f"Coverage of {PARAMETERS[name]}", "%, pooled") for name in PARAMETERS),
        Column("Joint coverage", "%, pooled"),
        Column("Recordings"),
    )
    table = exact.calibration
    kinds = table[table["test"] != "c2st"].groupby(["recordings", "sampler"], sort=False)
    rows = []
    for (made, sampler), part in kinds:
        pooled, single = part[part["subject"] == POOLED], part[part["subject"] != POOLED]
        covered = [
            _coverage(pooled, "sbc", name) if len(pooled) else _coverage(pooled, "", "")
            for name in PARAMETERS
        ]
        joint = _coverage(pooled, "tarp", "joint")
        answer = ANSWERS.get(str(sampler), str(sampler))
        cells = (RECORDINGS.get(str(made), str(made)), answer, _failed(pooled), _failed(single), *covered)
        rows.append(Row((*cells, joint, count(part["n"].max()))))
    note = (
        "Checks: ranks of the truth and coverage at all levels within simultaneous bands, joint coverage, "
        "contraction. Coverage is that of 90 % intervals and regions. At the subject's own data, the truth "
        "is a draw of its posterior and the recording a new one from it."
    )
    return Table(
        "Calibration on recordings of known parameters.", columns, tuple(rows), f"{note} {two_samples(table)}"
    )


def calibration_checks(exact: Exact) -> Table:
    """Return every check, the failed ones in bold."""
    columns = (
        *words("Subject", "Recordings", "Answer", "Test", "Quantity"),
        Column("n"),
        Column("Statistic"),
        Column("p-value"),
        Column("Limit"),
        *words("Failed"),
    )
    rows = []
    for row in records(exact.calibration):
        failed = bool(row["flagged"])
        cells = (
            str(row["subject"]),
            RECORDINGS.get(str(row["recordings"]), str(row["recordings"])),
            ANSWERS.get(str(row["sampler"]), str(row["sampler"])),
            str(row["test"]),
            quantity(str(row["quantity"])),
            count(row["n"]),
            significant(row["statistic"]),
            significant(row["p_value"], 2),
            significant(row["limit"], 2),
            Strong("yes") if failed else "no",
        )
        rows.append(Row(cells))
    return Table("Every check of calibration.", columns, tuple(rows))


def alarms_table(exact: Exact) -> Table:
    """Return how often the verdict raises an alarm on well-specified recordings and on others."""
    table = exact.misspecification
    columns = (
        *words("Subject", "Recordings"),
        *(Column(name, "% (interval)") for name in ALARMS),
        Column("Recordings"),
        Column("Median efficiency", "%"),
    )
    rows = []
    chosen = table[table["alarm"].isin(ALARMS)]
    for (subject, made), part in chosen.groupby(["subject", "recordings"], sort=False):
        rates = {str(row["alarm"]): row for row in records(part)}
        first = next(iter(rates.values()))
        cells = (
            str(subject),
            RECORDINGS.get(str(made), str(made)),
            *(_rate(rates[name]) if name in rates else MISSING for name in ALARMS),
            count(first["n"]),
            percent(first["median_efficiency"], 0),
        )
        rows.append(Row(cells, summary=subject == ALL_SUBJECTS))
    note = (
        "On recordings that the model itself made an alarm is false. On the volunteers recorded anew it is "
        "the power to see that their physiology is another than the model's. Intervals: 95 % Clopper-Pearson."
    )
    return Table("Alarms of the misspecification tests.", columns, tuple(rows), note)


def two_samples(calibration: pd.DataFrame) -> str:
    """Say how well a classifier tells samplers apart."""
    accuracies = calibration[calibration["test"] == "c2st"]
    if accuracies.empty:
        return "No samplers were compared."
    pairs = [
        f"{pair}: {fixed(part['statistic'].min(), 3)} to {fixed(part['statistic'].max(), 3)}"
        for pair, part in accuracies.groupby("sampler", sort=False)
    ]
    return f"Accuracy of a classifier that tells two samplers apart (0.5: it cannot), {'; '.join(pairs)}."


def _rate(row: Mapping[Hashable, Any]) -> str:
    return f"{percent(row['rate'])} ({span(percent(row['ci_low']), percent(row['ci_high']))})"


def _coverage(table: pd.DataFrame, test: str, name: str) -> str:
    rows = table[(table["test"] == test) & (table["quantity"] == name)]
    known = rows["coverage_90"].dropna()
    return percent(float(known.iloc[0])) if len(known) else MISSING


def _failed(table: pd.DataFrame) -> str:
    return f"{int(table['flagged'].sum())} of {len(table)}" if len(table) else MISSING
