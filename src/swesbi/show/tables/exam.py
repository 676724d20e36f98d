"""The tables of the exam as page and documentation show them, generators worst first.

matplotlib is not imported.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any, Final

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.exam.score import QUANTITIES
from swesbi.exam.settings import COHORT_NOISE, FORMER_NOISE
from swesbi.exam.table import NOT_TESTED
from swesbi.show.csv import checked
from swesbi.show.numbers import MISSING, count, fixed, percent, span
from swesbi.show.results import records
from swesbi.show.table import Cell, Column, Row, Strong, Table, words
from swesbi.show.tables.exam_outcomes import (
    ASKED,
    MOST_MISSED,
    NAMES,
    OF_EVERY_GENERATOR,
    Outcome,
    is_tested,
    outcomes,
)

NOISE: Final = {COHORT_NOISE: "the cohort's noise", FORMER_NOISE: "the cohort's former noise"}
WITHOUT_AND_WITH: Final = ("speeds alone", "with pressures")
SITTINGS: Final = ("first", "second")
COVERAGES: Final = ("coverage", "coverage_supported")
COLUMNS: Final = (
    "generator", "quantity", "n", "supported", "strained", "unsupported", *COVERAGES,
    *(f"{name}_{end}" for name in COVERAGES for end in ("low", "high")),
    "missed_and_supported", "bias_log", "width_log", "n_supported", "tested", "noise",
)  # fmt: skip
SAMPLER_COLUMNS: Final = (
    "generator", "hearts", "refused", "redrawn", "efficiency", "by_mcmc", "not_converged", "noise",
)  # fmt: skip
BOLD: Final = (
    f"Bold: less than {percent(ASKED[0], 0)} % covered, or more than {percent(MOST_MISSED, 0)} % missed."
)
NOTE: Final = (
    "Worst first; in between, generators that are not tested, too few of their hearts being supported. "
    "Verdicts: of all hearts, those refused making up the rest. Coverage (95 % Clopper-Pearson), bias (mean "
    "of log median / truth), width (median of log high / low): of the answered. Missed: attained stiffness "
    f"or k_SR outside its interval. {BOLD}"
)


def read_exam(path: Path) -> pd.DataFrame:
    """Read a table of the exam, one row a generator and quantity.

    Raises:
        ArtefactError: A column or every row is missing.
        FileNotFoundError: There is no such file.
    """
    return checked(pd.read_csv(path), path, COLUMNS, row="generator")


def read_samplers(path: Path) -> pd.DataFrame:
    """Read how the hearts of the exam were answered, one row a generator.

    Raises:
        ArtefactError: A column or every row is missing.
        FileNotFoundError: There is no such file.
    """
    return checked(pd.read_csv(path), path, SAMPLER_COLUMNS, row="generator")


def noise_of(table: pd.DataFrame) -> str:
    """Return the level of noise of a table of the exam in words: "the cohort's noise"."""
    return NOISE[table["noise"].iloc[0]]


def exam_table(table: pd.DataFrame, what: str) -> Table:
    """Return a row a generator and quantity: verdicts, coverage, what is missed, bias and width.

    Args:
        table: ``exam.csv``, of one level of noise.
        what: What sat, as the caption begins ("The exam").
    """
    columns = (
        *words("Hearts", "Quantity"),
        Column("Number"),
        *(Column(name, "%") for name in ("Supported", "Strained", "Unsupported")),
        Column("Coverage", "% of all answered (interval)"),
        Column("Coverage", "% of the supported (interval)"),
        Column("Missed", "% of the supported"),
        *(Column(name, "log") for name in ("Bias", "Width")),
    )
    rows = [_row(outcome, name) for outcome in outcomes(table) for name in QUANTITIES if name in outcome.rows]
    return Table(f"{what} at {noise_of(table)}.", columns, tuple(rows), NOTE)


def _row(outcome: Outcome, quantity: str) -> Row:
    row = outcome.rows[quantity]
    cells: tuple[Cell, ...] = (
        outcome.label,
        NAMES[quantity],
        count(row["n"]),
        *(percent(row[name], 0) for name in ("supported", "strained", "unsupported")),
        _coverage(row, "coverage"),
        _of_supported(row),
        _missed(row),
        *(fixed(row[name], 2) for name in ("bias_log", "width_log")),
    )
    return Row(cells, muted=not is_tested(row))


def _coverage(row: Mapping[Any, Any], name: str) -> str:
    ends = (percent(row[f"{name}_{end}"], 0) for end in ("low", "high"))
    shown = percent(row[name])
    return shown if shown == MISSING else f"{shown} ({span(*ends)})"


def _of_supported(row: Mapping[Any, Any]) -> Cell:
    if not is_tested(row):
        return NOT_TESTED
    shown = _coverage(row, "coverage_supported")
    return Strong(shown) if row["coverage_supported"] < ASKED[0] else shown


def _missed(row: Mapping[Any, Any]) -> Cell:
    if not is_tested(row):
        return NOT_TESTED
    shown = percent(row["missed_and_supported"])
    return Strong(shown) if row["missed_and_supported"] > MOST_MISSED else shown


def pressures_table(without: pd.DataFrame, with_them: pd.DataFrame, what: str) -> Table:
    """Return a row a generator and quantity: coverage and width from speeds alone, and with cuff pressures.

    Args:
        without: ``exam.csv``.
        with_them: ``exam_pressures.csv``, of the same level of noise.
        what: What sat, as the caption begins.

    Raises:
        ArtefactError: The two have no row in common.
    """
    columns = (
        *words("Hearts", "Quantity"),
        Column("Number"),
        *(Column(f"Coverage, {how}", "% of all answered (interval)") for how in WITHOUT_AND_WITH),
        *(Column(f"Coverage, {how}", "% of the supported (interval)") for how in WITHOUT_AND_WITH),
        *(Column(f"Width, {how}", "log") for how in WITHOUT_AND_WITH),
    )
    informed = {outcome.generator: outcome for outcome in outcomes(with_them)}
    both = [outcome for outcome in outcomes(without) if outcome.generator in informed]
    rows = [
        _beside(outcome, informed[outcome.generator], name)
        for outcome in both
        for name in QUANTITIES
        if name in outcome.rows and name in informed[outcome.generator].rows
    ]
    if not rows:
        raise ArtefactError(
            "the exam with cuff pressures has none of the generators without; run `make exam`"
        )
    return Table(f"{what} with cuff pressures, at {noise_of(with_them)}.", columns, tuple(rows))


def _beside(before: Outcome, after: Outcome, quantity: str) -> Row:
    pair = (before.rows[quantity], after.rows[quantity])
    cells: tuple[Cell, ...] = (
        before.label,
        NAMES[quantity],
        count(pair[1]["n"]),
        *(_coverage(row, "coverage") for row in pair),
        *(_of_supported(row) for row in pair),
        *(fixed(row["width_log"], 2) for row in pair),
    )
    return Row(cells, muted=not is_tested(pair[1]))


def sittings_table(first: pd.DataFrame, second: pd.DataFrame, what: str) -> Table:
    """Return a row a generator and quantity: verdicts, coverage, what is missed and width, of both sittings.

    Args:
        first: Rows of the first sitting, as of ``exam.csv``.
        second: Of the second, at the same level of noise; of fewer generators, it may be.
        what: What sat, as the caption begins.
    """
    columns = (
        *words("Hearts", "Quantity"),
        *(Column(f"Supported, {which}", "%") for which in SITTINGS),
        *(Column(f"Coverage, {which}", "% of all answered (interval)") for which in SITTINGS),
        *(Column(f"Missed, {which}", "% of the supported") for which in SITTINGS),
        *(Column(f"Width, {which}", "log") for which in SITTINGS),
    )
    before = {outcome.generator: outcome for outcome in outcomes(first)}
    rows = [
        _in_both(before[outcome.generator], outcome, name)
        for outcome in outcomes(second)
        for name in QUANTITIES
        if name in outcome.rows
    ]
    return Table(f"{what} at {noise_of(second)}, in both sittings.", columns, tuple(rows))


def _in_both(first: Outcome, second: Outcome, quantity: str) -> Row:
    pair = (first.rows[quantity], second.rows[quantity])
    cells: tuple[Cell, ...] = (
        second.label,
        NAMES[quantity],
        *(percent(row["supported"], 0) for row in pair),
        *(_coverage(row, "coverage") for row in pair),
        *(_missed(row) for row in pair),
        *(fixed(row["width_log"], 2) for row in pair),
    )
    return Row(cells, muted=not is_tested(pair[1]))


def generators_table(table: pd.DataFrame, what: str) -> Table:
    """Return a row a generator: what is supported, covered of the supported, and missed.

    Args:
        table: ``exam.csv``, of one level of noise.
        what: What sat, as the caption begins.
    """
    columns = (
        *words("Hearts"),
        Column("Number"),
        Column("Supported", "%"),
        *(Column(f"Of the supported: {NAMES[name]} covered", "% (interval)") for name in OF_EVERY_GENERATOR),
        Column("Either missed", "% of the supported"),
    )
    rows = [_generator(outcome) for outcome in outcomes(table)]
    return Table(f"{what} at {noise_of(table)}.", columns, tuple(rows), BOLD)


def _generator(outcome: Outcome) -> Row:
    cells: tuple[Cell, ...] = (
        outcome.label,
        count(outcome.of_hearts["n"]),
        percent(outcome.supported, 0),
        *(
            _of_supported(outcome.rows[name]) if name in outcome.rows else MISSING
            for name in OF_EVERY_GENERATOR
        ),
        _missed(outcome.of_hearts),
    )
    return Row(cells, muted=not outcome.tested)


def samplers_table(samplers: pd.DataFrame, what: str) -> Table:
    """Return a row a generator: how its hearts were answered.

    Args:
        samplers: ``exam_samplers.csv``, of one level of noise.
        what: What sat, as the caption begins.
    """
    columns = (
        *words("Hearts"),
        *(Column(name) for name in ("Number", "Refused", "Drawn again")),
        Column("Efficiency", "%, median"),
        *(Column(name, "% of the answered") for name in ("By MCMC", "Not converged")),
    )
    rows = tuple(_sampler(row) for row in records(samplers))
    return Table(f"{what} at {noise_of(samplers)}: how the hearts were answered.", columns, rows)


def _sampler(row: Mapping[Hashable, Any]) -> Row:
    cells = (
        Outcome(str(row["generator"]), {}).label,
        *(count(row[name]) for name in ("hearts", "refused", "redrawn")),
        percent(row["efficiency"], 0),
        *(percent(row[name]) for name in ("by_mcmc", "not_converged")),
    )
    return Row(cells)
