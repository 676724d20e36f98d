"""The generated part on free-running recordings of the page on experiments over a population."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import pandas as pd

from swesbi.parameters import THETA
from swesbi.report.csv import checked
from swesbi.report.numbers import count, percent, span
from swesbi.report.results import records
from swesbi.report.table import Cell, Column, Row, Table, markdown, words
from tools.docs.results import read_table

MARK: Final = "free_running"
NOT_RUN: Final = "Not measured yet: `make full` on a finished study."
NOT_COMPARED: Final = "Not compared yet: `studies/validation/gated_as_pushes.py`."
ALL: Final = "all"
COLUMNS: Final = (
    "pushes", "parameter", "nominal", "coverage", "ci_low", "ci_high", "n",
    "median_efficiency", "by_mcmc", "false_alarms",
)  # fmt: skip


@dataclass(frozen=True)
class PushesResults:
    """What was measured of free-running recordings.

    Attributes:
        table: Of ``make full``; None before it has run.
        doors: Of ``studies/validation/gated_as_pushes.py``, a row a heart; None before it has run.
        interval: Mass of the credible intervals that are shown.
    """

    table: pd.DataFrame | None
    doors: pd.DataFrame | None
    interval: float

    @classmethod
    def read(cls, folder: Path, interval: float) -> Self:
        """Read the stored tables.

        Raises:
            ArtefactError: A table lacks columns or every row.
        """
        names = ("amortised_pushes", "gated_as_pushes")
        table, doors = (folder / f"{name}.csv" for name in names)
        return cls(
            checked(read_table(table), table, COLUMNS, row="row") if table.is_file() else None,
            checked(read_table(doors), doors, ("c2st",), row="heart") if doors.is_file() else None,
            interval,
        )


def pushes_part(results: PushesResults) -> str:
    """Show coverage by number of pushes, and gated recordings given as pushes."""
    table = NOT_RUN if results.table is None else markdown(pushes_table(results.table, results.interval))
    return f"{table}\n\n{_doors(results.doors)}"


def pushes_table(table: pd.DataFrame, interval: float) -> Table:
    """Return a row a number of pushes: coverage of each active parameter, efficiency, MCMC, false alarms.

    Args:
        table: ``amortised_pushes.csv``.
        interval: Mass of the credible intervals.
    """
    shown = table[table["nominal"] == interval].astype({"pushes": str})
    columns = (
        *words("Pushes"),
        Column("Recordings"),
        *(Column(f"{parameter.text} inside", "% (interval)") for parameter in THETA),
        Column("Efficiency", "%, median"),
        *(Column(name, "%") for name in ("By MCMC", "False alarms")),
    )
    rows = [_row(str(pushes), group) for pushes, group in shown.groupby("pushes", sort=False)]
    return Table("Free-running recordings of fresh contexts.", columns, tuple(rows))


def _row(pushes: str, group: pd.DataFrame) -> Row:
    by_parameter = {row["parameter"]: row for row in records(group)}
    beside = group.iloc[0]
    cells: tuple[Cell, ...] = (
        pushes,
        count(beside["n"]),
        *(_coverage(by_parameter[parameter.name]) for parameter in THETA),
        percent(beside["median_efficiency"], 0),
        percent(beside["by_mcmc"]),
        percent(beside["false_alarms"]),
    )
    return Row(cells, muted=pushes == ALL)


def _coverage(row: Mapping[Hashable, Any], ends: tuple[str, str] = ("ci_low", "ci_high")) -> str:
    shown = (percent(row[name], 0) for name in ends)
    return f"{percent(row['coverage'])} ({span(*shown)})"


def _doors(doors: pd.DataFrame | None) -> str:
    if doors is None:
        return NOT_COMPARED
    accuracy = doors["c2st"]
    return (
        f"{len(doors)} gated recordings given as pushes, a row a phase with its standard error: a classifier "
        f"tells draws of that answer from draws of the gated one, by all parameters, with an accuracy of "
        f"{accuracy.mean():.3f} in the mean and {accuracy.max():.3f} at most, .5 being chance; the "
        f"log-likelihoods of both agree to {doors['log_likelihoods_differ'].max():.0e}."
    )
