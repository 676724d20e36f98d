"""The table of the validation: its columns, and as the page shows it, worst first.

matplotlib is not imported.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pandas as pd

from swesbi.report.csv import checked
from swesbi.report.numbers import MISSING, count, fixed, percent, span
from swesbi.report.table import Cell, Column, Row, Strong, Table, words
from swesbi.report.tables.validation_outcomes import (
    ASKED,
    MOST_MISSED,
    NAMES,
    NOT_TESTED,
    QUANTITIES,
    Outcome,
    is_tested,
    outcomes,
)

COVERAGES: Final = ("coverage", "coverage_not_contradicted")
COLUMNS: Final = (
    "generator", "quantity", "n", "not_contradicted", "strained", "contradicted", *COVERAGES,
    *(f"{name}_{end}" for name in COVERAGES for end in ("low", "high")),
    "missed_not_contradicted", "bias_log", "width_log", "n_not_contradicted", "tested",
)  # fmt: skip
FORMER: Final = {
    "supported": "not_contradicted",
    "unsupported": "contradicted",
    "coverage_supported": "coverage_not_contradicted",
    "coverage_supported_low": "coverage_not_contradicted_low",
    "coverage_supported_high": "coverage_not_contradicted_high",
    "missed_and_supported": "missed_not_contradicted",
    "n_supported": "n_not_contradicted",
}
"""Columns of the tables of former sittings, and what they are called now."""
BOLD: Final = (
    f"Bold: less than {percent(ASKED[0], 0)} % covered, or more than {percent(MOST_MISSED, 0)} % missed."
)
NOTE: Final = (
    "Worst first; in between, generators that are not tested, too few of their hearts being not "
    "contradicted. Verdicts: of all hearts, those refused making up the rest. Coverage (95 % "
    "Clopper-Pearson), bias (mean of log median / truth), width (median of log high / low): of the "
    "answered. Missed: attained stiffness "
    f"or k_SR outside its interval. {BOLD}"
)


def read_validation(path: Path) -> pd.DataFrame:
    """Read a table of the validation, one row a generator and quantity; former names of columns are mapped.

    Raises:
        ArtefactError: A column or every row is missing.
        FileNotFoundError: There is no such file.
    """
    return checked(pd.read_csv(path).rename(columns=FORMER), path, COLUMNS, row="generator")


def validation_table(table: pd.DataFrame, caption: str) -> Table:
    """Return a row a generator and quantity: verdicts, coverage, what is missed, bias and width.

    Args:
        table: ``validation.csv``.
        caption: Its caption, a sentence.
    """
    columns = (
        *words("Hearts", "Quantity"),
        Column("Number"),
        *(Column(name, "%") for name in ("Not contradicted", "Strained", "Contradicted")),
        Column("Coverage", "% of all answered (interval)"),
        Column("Coverage", "% of the not contradicted (interval)"),
        Column("Missed", "% of the not contradicted"),
        *(Column(name, "log") for name in ("Bias", "Width")),
    )
    rows = [_row(outcome, name) for outcome in outcomes(table) for name in QUANTITIES if name in outcome.rows]
    return Table(caption, columns, tuple(rows), NOTE)


def _row(outcome: Outcome, quantity: str) -> Row:
    row = outcome.rows[quantity]
    cells: tuple[Cell, ...] = (
        outcome.label,
        NAMES[quantity],
        count(row["n"]),
        *(percent(row[name], 0) for name in ("not_contradicted", "strained", "contradicted")),
        _coverage(row, "coverage"),
        _of_not_contradicted(row),
        _missed(row),
        *(fixed(row[name], 2) for name in ("bias_log", "width_log")),
    )
    return Row(cells, muted=not is_tested(row))


def _coverage(row: Mapping[Any, Any], name: str) -> str:
    ends = (percent(row[f"{name}_{end}"], 0) for end in ("low", "high"))
    shown = percent(row[name])
    return shown if shown == MISSING else f"{shown} ({span(*ends)})"


def _of_not_contradicted(row: Mapping[Any, Any]) -> Cell:
    if not is_tested(row):
        return NOT_TESTED
    shown = _coverage(row, "coverage_not_contradicted")
    return Strong(shown) if row["coverage_not_contradicted"] < ASKED[0] else shown


def _missed(row: Mapping[Any, Any]) -> Cell:
    if not is_tested(row):
        return NOT_TESTED
    shown = percent(row["missed_not_contradicted"])
    return Strong(shown) if row["missed_not_contradicted"] > MOST_MISSED else shown
