"""The generated part on free-running recordings of the page on experiments over a population."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import pandas as pd

from swesbi.parameters import THETA
from swesbi.report.csv import checked
from swesbi.report.numbers import percent, span
from swesbi.report.results import columns_of, wide
from swesbi.report.table import Column, Table, markdown, words
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
        words("pushes", "Pushes"),
        Column("n", "Recordings", "", "d"),
        *(
            Column(
                columns_of(parameter.name, ("coverage", "ci_low", "ci_high")),
                f"{parameter.text} inside",
                "% (interval)",
                _coverage,
            )
            for parameter in THETA
        ),
        Column("median_efficiency", "Efficiency", "%, median", "0%"),
        Column("by_mcmc", "By MCMC", "%", "1%"),
        Column("false_alarms", "False alarms", "%", "1%"),
    )
    return Table("Free-running recordings of fresh contexts.", wide(shown, ["pushes"], "parameter"), columns)


def _coverage(value: float, low: float, high: float) -> str:
    return f"{percent(value)} ({span(percent(low, 0), percent(high, 0))})"


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
