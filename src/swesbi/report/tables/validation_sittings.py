"""The stored table of all sittings of the validation, and the sitting that is shown.

It has the columns of ``validation.csv`` behind those that say which sitting a row is of.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.report.csv import checked
from swesbi.report.tables.validation import COLUMNS
from swesbi.report.tables.validation_outcomes import K_SR, POOLED

OF_SITTING: Final = ("sitting", "date", "model")
"""Its number, the day on which it ended, and what was changed of the model before it."""
COMPARED: Final = 2
"""The sitting whose width of k_SR on (a) later ones are compared with."""


@dataclass(frozen=True)
class Sitting:
    """One sitting.

    Attributes:
        number: From 1 on.
        date: The day on which it ended.
        model: What was changed of the model before it.
        rows: Its rows, as ``validation.csv`` has them.
    """

    number: int
    date: str
    model: str
    rows: pd.DataFrame

    @property
    def letters(self) -> frozenset[str]:
        """Letters of the generators that were asked."""
        return frozenset(self.rows["generator"].str.partition(":")[0]) - {POOLED}


def read_sittings(path: Path) -> tuple[Sitting, ...]:
    """Read the stored table of all sittings, in the order of their numbers.

    Raises:
        ArtefactError: A column or every row is missing.
        FileNotFoundError: There is no such file.
    """
    table = checked(pd.read_csv(path), path, (*OF_SITTING, *COLUMNS), row="sitting")
    return tuple(_sitting(rows) for _, rows in table.groupby("sitting", sort=True))


def _sitting(rows: pd.DataFrame) -> Sitting:
    number, date, model = rows.iloc[0][list(OF_SITTING)]
    return Sitting(int(number), str(date), str(model), rows.drop(columns=list(OF_SITTING)))


def last_whole(sittings: tuple[Sitting, ...]) -> Sitting:
    """Return the last sitting that asked every generator that any sitting asked.

    Raises:
        ArtefactError: None did.
    """
    asked = frozenset[str]().union(*(sitting.letters for sitting in sittings))
    whole = [sitting for sitting in sittings if sitting.letters == asked]
    if not whole:
        raise ArtefactError(f"no sitting of the validation asked all generators, {', '.join(sorted(asked))}")
    return whole[-1]


def compared_width(sittings: tuple[Sitting, ...], shown: Sitting) -> float | None:
    """Return the width of k_SR on (a) that a sitting is compared with; None for one that is not later."""
    before = [sitting for sitting in sittings if sitting.number == COMPARED < shown.number]
    for sitting in before:
        rows = sitting.rows
        of_a = rows["generator"].str.startswith("a:") & (rows["quantity"] == K_SR)
        return float(rows.loc[of_a, "width_log"].iloc[0])
    return None
