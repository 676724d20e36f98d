"""Reading CSV tables cell by cell, so that every complaint names file, row, column and value."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.recording.samples import RecordingError


@dataclass(frozen=True)
class Table:
    """The cells of a CSV file as text; row k of the frame is line k + 2 of the file."""

    path: Path
    cells: pd.DataFrame

    def fail(self, row: int, column: str, reason: str) -> RecordingError:
        """Return the error for one cell, to be raised: file, row, column, value and ``reason``."""
        value = self.cells[column].iloc[row]
        return RecordingError(f"{self.path}, row {row + 2}, column {column!r}: {value!r} {reason}")

    def number(
        self, column: str, low: float, high: float, hint: str, *, may_be_empty: bool = False
    ) -> NDArray[np.float64]:
        """Return a column of numbers within [low, high]; empty cells become NaN where allowed.

        Raises:
            RecordingError: A cell is not a number or lies outside the bounds.
        """
        text = self.cells[column]
        values = pd.to_numeric(text, errors="coerce").to_numpy(dtype=np.float64)
        empty = (text == "").to_numpy() & may_be_empty
        self._check(column, ~(np.isfinite(values) | empty), "is not a number; write it with a decimal point")
        outside = ~empty & ~((values >= low) & (values <= high))
        self._check(column, outside, f"is outside [{low:g}, {high:g}]; {hint}")
        return values

    def integer(self, column: str, low: int, high: int, hint: str) -> NDArray[np.int64]:
        """Return a column of whole numbers within [low, high].

        Raises:
            RecordingError: A cell is not a whole number or lies outside the bounds.
        """
        values = self.number(column, low, high, hint)
        self._check(column, values != np.round(values), "is not a whole number; correct the cell")
        return values.astype(np.int64)

    def choice(self, column: str, allowed: Sequence[str]) -> NDArray[np.str_]:
        """Return a column whose cells are all among ``allowed``.

        Raises:
            RecordingError: A cell holds something else.
        """
        text = self.cells[column]
        self._check(column, ~text.isin(list(allowed)).to_numpy(), f"is none of {', '.join(allowed)}")
        return text.to_numpy(dtype=np.str_)

    def unique(self, columns: Sequence[str]) -> None:
        """Refuse a row that repeats the ``columns`` of an earlier one.

        Raises:
            RecordingError: Two rows agree in all of ``columns``.
        """
        repeated = self.cells.duplicated(list(columns)).to_numpy()
        self._check(columns[-1], repeated, f"repeats the {', '.join(columns)} of an earlier row; keep one")

    def _check(self, column: str, wrong: NDArray[np.bool_], reason: str) -> None:
        if wrong.any():
            raise self.fail(int(np.argmax(wrong)), column, reason)


def read_table(path: Path, columns: Sequence[str]) -> Table:
    """Read a comma-separated table that has at least ``columns``; others are kept and ignored.

    Raises:
        RecordingError: The file is missing, empty, not UTF-8, ragged, or lacks columns.
    """
    lines = _lines(path)
    header = [name.strip() for name in lines[0]]
    if missing := [name for name in columns if name not in header]:
        raise RecordingError(
            f"{path}, row 1: lacks the columns {', '.join(missing)}; it has {', '.join(header)}. "
            "Name them in the first row, separated by commas"
        )
    if len(set(header)) < len(header):
        raise RecordingError(f"{path}, row 1: names a column twice: {', '.join(header)}; rename one")
    rows = [_cells(path, row, cells, len(header)) for row, cells in enumerate(lines[1:], start=2)]
    return Table(path, pd.DataFrame(rows, columns=header, dtype=object))


def _lines(path: Path) -> list[list[str]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = list(csv.reader(file))
    except FileNotFoundError as error:
        raise RecordingError(f"{path}: no such file; put the table there or correct the path") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read as UTF-8 CSV ({error}); save it as such") from error
    while lines and not any(cell.strip() for cell in lines[-1]):
        lines.pop()
    if len(lines) < 2:
        raise RecordingError(f"{path}: holds no data row; it needs a header and at least one row")
    return lines


def _cells(path: Path, row: int, cells: list[str], expected: int) -> list[str]:
    if len(cells) != expected:
        raise RecordingError(
            f"{path}, row {row}: has {len(cells)} cells, the header has {expected}; "
            "remove blank lines, and decimal commas, and complete the row"
        )
    return [cell.strip() for cell in cells]
