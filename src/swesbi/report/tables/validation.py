"""The table of the validation: its columns, and as the page shows it.

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
    BY_CHANCE,
    CONFIDENCE,
    MOST_MISSED,
    NAMES,
    NOT_TESTED,
    QUANTITIES,
    REACHED,
    Outcome,
    falls_short,
    is_tested,
    missed_too_often,
    outcomes,
)

COVERAGES: Final = ("coverage", "coverage_not_contradicted")
MISSED: Final = "missed_not_contradicted"
COLUMNS: Final = (
    "generator", "quantity", "n", "not_contradicted", "strained", "contradicted", *COVERAGES, MISSED,
    *(f"{name}_{end}" for name in (*COVERAGES, MISSED) for end in ("low", "high")),
    "bias_log", "width_log", "n_not_contradicted", "tested",
)  # fmt: skip
BOLD: Final = (
    f"Bold: a coverage whose interval does not reach {percent(REACHED, 0)} %, or more missed than by chance "
    f"({percent(BY_CHANCE, 0)} %, or {percent(MOST_MISSED, 0)} % of several generators together)."
)
NOTE: Final = (
    "Pooled generators come first, then those that miss what is asked. Verdicts: of all hearts, those "
    f"refused making up the rest. Intervals: {percent(CONFIDENCE, 0)} % Clopper-Pearson. "
    "Bias (mean of log median / truth) and "
    "width (median of log high / low): of the answered. Missed: shown stiffness or k_SR outside its "
    f"interval; two independent calibrated intervals miss {percent(BY_CHANCE, 0)} % by chance. {BOLD}"
)


def read_validation(path: Path) -> pd.DataFrame:
    """Read a table of the validation, one row a generator and quantity.

    Raises:
        ArtefactError: A column or every row is missing.
        FileNotFoundError: There is no such file.
    """
    return checked(pd.read_csv(path), path, COLUMNS, row="generator")


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
        Column("Missed", f"% of the not contradicted (interval); {percent(BY_CHANCE, 0)} by chance"),
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
        _of_not_contradicted(outcome, quantity),
        _missed(outcome, quantity),
        *(fixed(row[name], 2) for name in ("bias_log", "width_log")),
    )
    return Row(cells, muted=not is_tested(row))


def _coverage(row: Mapping[Any, Any], name: str) -> str:
    ends = (percent(row[f"{name}_{end}"], 0) for end in ("low", "high"))
    shown = percent(row[name])
    return shown if shown == MISSING else f"{shown} ({span(*ends)})"


def _of_not_contradicted(outcome: Outcome, quantity: str) -> Cell:
    row = outcome.rows[quantity]
    if not is_tested(row):
        return NOT_TESTED
    shown = _coverage(row, "coverage_not_contradicted")
    return Strong(shown) if falls_short(outcome.generator, quantity, row) else shown


def _missed(outcome: Outcome, quantity: str) -> Cell:
    """Return the share missed, in the first row of a generator: it is of its hearts, not of a quantity."""
    row = outcome.rows[quantity]
    if row is not outcome.of_hearts:
        return ""
    if not is_tested(row):
        return NOT_TESTED
    shown = _coverage(row, MISSED)
    return Strong(shown) if missed_too_often(outcome.generator, row) else shown
