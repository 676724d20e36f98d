"""The validation of the shipped study by hearts of other generators, as its stored table has it.

The stored table has all rounds: the columns of ``validation.csv`` behind those that say which round a row
is of. matplotlib is not imported.
"""

from __future__ import annotations

from typing import Annotated, Final, NamedTuple

import pandas as pd

from swesbi.artefacts import UnfitError
from swesbi.artefacts.csv import Table as Format
from swesbi.report.columns import COLUMNS as COLUMNS_SHOWN
from swesbi.report.numbers import percent, span
from swesbi.report.table import MARK, MUTED, Cell, Column, Strong, Table, words
from swesbi.report.tables.validation_outcomes import (
    BY_CHANCE,
    CONFIDENCE,
    COVERED,
    K_SR,
    MISSED,
    MOST_MISSED,
    NOT_TESTED,
    POOLED,
    REACHED,
    in_brief,
    judged,
)

VERDICTS: Final = ("not_contradicted", "doubtful", "contradicted")
OF_THOSE: Final = "% of the not contradicted (interval)"
RATES: Final = {name: (name, f"{name}_low", f"{name}_high") for name in ("coverage", COVERED, MISSED)}
COLUMNS: Final = (
    "generator", "quantity", "n", *VERDICTS,
    *(column for columns in RATES.values() for column in columns),
    "bias_log", "width_log", "n_not_contradicted", "tested",
)  # fmt: skip
OF_ROUND: Final = ("round", "date", "model")
"""Its number, the day on which it ended, and what was changed of the model before it."""
VALIDATION: Final = Format(columns=COLUMNS, row="generator")
"""``validation.csv``: one row a generator and quantity."""
ROUNDS: Final = Format(columns=(*OF_ROUND, *COLUMNS), row="round")
RoundsTable = Annotated[pd.DataFrame, ROUNDS]
"""The stored table of all rounds."""
COMPARED: Final = 2
"""The round whose width of k_SR on (a) later ones are compared with."""
NOTE: Final = (
    "Pooled generators come first, then those that miss what is asked. Verdicts: of all hearts, those "
    f"refused making up the rest. Intervals: {percent(CONFIDENCE, 0)} % Clopper-Pearson. "
    "Bias (mean of log median / truth) and "
    "width (median of log high / low): of the answered. Missed: peak active stiffness or k_SR outside its "
    f"interval; two independent calibrated intervals miss {percent(BY_CHANCE, 0)} % by chance. "
    f"Bold: a coverage whose interval does not reach {percent(REACHED, 0)} %, or more missed than by chance "
    f"({percent(BY_CHANCE, 0)} %, or {percent(MOST_MISSED, 0)} % of several generators together)."
)


class StoredValidation(NamedTuple):
    """What the page shows of the validation: what came out in sentences, and all of it."""

    brief: tuple[str, ...]
    table: Table


def letters(rows: pd.DataFrame) -> frozenset[str]:
    """Return the letters of the generators that were asked."""
    return frozenset(rows["generator"].str.partition(":")[0]) - {POOLED}


def shown_validation(table: pd.DataFrame) -> StoredValidation:
    """Return what the page shows: the last round that asked every generator that any round asked."""
    whole = [rows for _, rows in table.groupby("round") if letters(rows) == letters(table)]
    if not whole:
        named = ", ".join(sorted(letters(table)))
        raise UnfitError("validation", f"no round of the validation asked all generators, {named}")
    shown = whole[-1]
    number, date, model = shown.iloc[0][list(OF_ROUND)]
    return StoredValidation(
        in_brief(shown, compared_width(table, number)),
        validation_table(shown, f"The validation of the shipped study: round {number}, {date}; {model}."),
    )


def compared_width(rounds: pd.DataFrame, number: int) -> float | None:
    """Return the width of k_SR on (a) that a round is compared with; None for one that is not later."""
    of_a = rounds["generator"].str.startswith("a:") & (rounds["quantity"] == K_SR)
    widths = rounds.loc[of_a & (rounds["round"] == COMPARED), "width_log"]
    return float(widths.iloc[0]) if len(widths) and number > COMPARED else None


def validation_table(table: pd.DataFrame, caption: str) -> Table:
    """Return a row a generator and quantity: verdicts, coverage, what is missed, bias and width."""
    columns = (
        words("label", "Hearts"),
        COLUMNS_SHOWN["quantity"],
        Column("n", "Number", "", "d"),
        *(Column(each, each.replace("_", " ").capitalize(), "%", "0%") for each in VERDICTS),
        Column(RATES["coverage"], "Coverage", "% of all answered (interval)", _rate),
        Column((*RATES[COVERED], "is_tested", "short"), "Coverage", OF_THOSE, _judged),
        Column(
            (*RATES[MISSED], "is_tested", "often", "first"),
            "Missed",
            f"{OF_THOSE}; {percent(BY_CHANCE, 0)} by chance",
            _judged,
        ),
        Column("bias_log", "Bias", "log", "2f"),
        Column("width_log", "Width", "log", "2f"),
    )
    rows = judged(table)
    return Table(
        caption, rows.assign(**{MARK: rows["is_tested"].map({True: "", False: MUTED})}), columns, NOTE
    )


def _rate(value: float, low: float, high: float) -> str:
    shown = percent(value)
    return shown if pd.isna(value) else f"{shown} ({span(percent(low, 0), percent(high, 0))})"


def _judged(value: float, low: float, high: float, tested: bool, wrong: bool, first: bool = True) -> Cell:
    """Return a rate, bold where it is not as asked; what is missed is of hearts: of the first row alone."""
    if not first:
        return ""
    shown = _rate(value, low, high) if tested else NOT_TESTED
    return Strong(shown) if wrong else shown
