"""Writing tables as CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts import atomic_path

EIGHT_DIGITS: Final = "%.8g"


def write_csv(path: Path, table: pd.DataFrame, float_format: str | None = EIGHT_DIGITS) -> None:
    """Write a table atomically, without its index; NaN becomes an empty field."""
    with atomic_path(path) as temporary:
        table.to_csv(temporary, index=False, float_format=float_format, lineterminator="\n")
