"""The comparison with the paper, number by number."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.report.names import with_symbols
from swesbi.report.numbers import MINUS
from swesbi.report.results import records
from swesbi.report.table import Row, Table, words

COLUMNS: Final = ("quantity", "paper", "this_study", "note")


def read_comparison(path: Path) -> pd.DataFrame:
    """Read ``paper_comparison.csv`` as text, as it was written.

    Raises:
        ArtefactError: A column is missing.
    """
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    if missing := [name for name in COLUMNS if name not in table.columns]:
        raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}; delete it and rerun")
    return table


def paper_table(comparison: pd.DataFrame, cohort_title: str) -> Table:
    """Return the comparison; numbers keep the digits that the table of the study gives them."""
    columns = words("Quantity", "Paper", "This study", "Reading")
    rows = tuple(
        Row(
            (
                with_symbols(str(row["quantity"])),
                _number(row["paper"]),
                _number(row["this_study"]),
                with_symbols(str(row["note"])),
            )
        )
        for row in records(comparison)
    )
    return Table(f"Every number of the paper, and of this study ({cohort_title}).", columns, rows)


def _number(text: object) -> str:
    """Return a number with a true minus; text passes."""
    return f"{MINUS}{str(text)[1:]}" if str(text)[:1] == "-" and str(text)[1:2].isdigit() else str(text)
