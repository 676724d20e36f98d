"""Tables as CSV: written atomically, and checked when they are read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts import ArtefactError, atomic_path

EIGHT_DIGITS: Final = "%.8g"


def write_csv(path: Path, table: pd.DataFrame, float_format: str | None = EIGHT_DIGITS) -> None:
    """Write a table atomically, without its index; NaN becomes an empty field."""
    with atomic_path(path) as temporary:
        table.to_csv(temporary, index=False, float_format=float_format, lineterminator="\n")


def checked(table: pd.DataFrame, path: Path, columns: Sequence[str], row: str = "") -> pd.DataFrame:
    """Return a table that was read from a file, once it has what it should have.

    Args:
        table: The table.
        path: Its file.
        columns: The columns that it must have; it may have others.
        row: What a row is ("epoch"), where there must be one at least.

    Raises:
        ArtefactError: A column or every row is missing.
    """
    if missing := [name for name in columns if name not in table.columns]:
        raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}; delete it and rerun")
    if row and table.empty:
        raise ArtefactError(f"{path}: holds no {row}; delete it and rerun")
    return table
