"""A table cell by cell, as text: checked column by column, every complaint with row, column and value."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from swesbi.recording.problems import Problem, raise_any

if TYPE_CHECKING:
    import pandas as pd

SHOWN_ROWS: Final = 5
MISSING: Final = ("", "NaN", "nan", "NAN")  # MATLAB writes an empty number as NaN


@dataclass(frozen=True)
class Table:
    """The cells of the columns that are used, as text, and the problems found in them so far.

    Attributes:
        source: The file, for messages.
        cells: One column a name, every cell a string.
        rows: Where each row of ``cells`` stands in the file.
        unit: What ``rows`` counts: "row" of a text file, or "element" of a vector.
        problems: Grows with every check; :meth:`finish` raises them together.
    """

    source: str
    cells: pd.DataFrame
    rows: NDArray[np.int64]
    unit: str = "row"
    problems: list[Problem] = field(default_factory=list)

    def number(
        self, column: str, low: float, high: float, remedy: str, *, may_be_empty: bool = False
    ) -> NDArray[np.float64]:
        """Return a column of numbers within [low, high]; NaN where empty, which may be allowed, or wrong."""
        import pandas as pd  # a third of a second, which whoever only reads the configuration need not wait

        text = self.cells[column]
        values = np.asarray(pd.to_numeric(text, errors="coerce"), dtype=np.float64)
        empty = text.isin(MISSING).to_numpy() & may_be_empty
        known = np.isfinite(values)
        self.flag(column, ~known & ~empty, "is not a number", "write a number with a decimal point")
        self.flag(column, known & ~((values >= low) & (values <= high)), _outside(low, high), remedy)
        return np.where(known, values, np.nan)

    def integer(self, column: str, low: int, high: int, remedy: str) -> NDArray[np.int64]:
        """Return a column of whole numbers within [low, high]; what is wrong becomes ``low``."""
        values = self.number(column, low, high, remedy)
        fraction = np.isfinite(values) & (values != np.round(values))
        self.flag(column, fraction, "is not a whole number", "correct the cell")
        return np.clip(np.nan_to_num(values, nan=low), low, high).astype(np.int64)

    def choice(self, column: str, allowed: Sequence[str]) -> NDArray[np.str_]:
        """Return a column whose cells should all be among ``allowed``."""
        text = self.cells[column]
        options = ", ".join(allowed)
        wrong = ~text.isin(list(allowed)).to_numpy()
        self.flag(column, wrong, f"is none of {options}", "write one of them, in this spelling")
        return text.to_numpy(dtype=np.str_)

    def unique(self, columns: Sequence[str]) -> None:
        """Refuse rows that repeat the ``columns`` of an earlier one."""
        repeated = self.cells.duplicated(list(columns)).to_numpy()
        self.flag(columns[-1], repeated, f"repeats the {', '.join(columns)} of an earlier row", "keep one")

    def flag(self, column: str, wrong: NDArray[np.bool_], reason: str, remedy: str) -> None:
        """Note a problem for each wrong row: the first few one by one, the rest as a number."""
        found = np.flatnonzero(wrong)
        for index in found[:SHOWN_ROWS]:
            self.note(int(index), column, reason, remedy)
        if more := len(found) - SHOWN_ROWS:
            if more < 0:
                return
            last = self.rows[found[-1]]
            text = f"likewise in {more} more {self.unit}s, the last of them {last}: {reason}"
            self.problems.append(Problem(self.source, text, remedy, column=column))

    def note(self, index: int, column: str, reason: str, remedy: str) -> None:
        """Note a problem of one cell."""
        value, row = str(self.cells[column].iloc[index]), int(self.rows[index])
        self.problems.append(Problem(self.source, reason, remedy, row, column, value, self.unit))

    def finish(self) -> None:
        """Raise all problems found.

        Raises:
            RecordingError: There is at least one.
        """
        raise_any(self.problems)


def check_names(source: str, names: Sequence[str], required: Sequence[str], remedy: str) -> list[Problem]:
    """Return the problems of a table's column names: missing ones, and ones that stand there twice."""
    problems = []
    if missing := [name for name in required if name not in names]:
        known = ", ".join(name for name in names if name)
        reason = f"lacks the columns {', '.join(missing)}; it has {known or 'none'}{_close(missing, names)}"
        problems.append(Problem(source, reason, remedy, row=None))
    if twice := sorted({name for name in names if name and list(names).count(name) > 1}):
        problems.append(Problem(source, f"names a column twice: {', '.join(twice)}", "rename or remove one"))
    return problems


def _close(missing: Sequence[str], names: Sequence[str]) -> str:
    lowered = {name.lower(): name for name in names}
    found = {name: difflib.get_close_matches(name, lowered, n=1, cutoff=0.8) for name in missing}
    pairs = [f"{lowered[close[0]]!r} should be {name!r}" for name, close in found.items() if close]
    return f" ({', '.join(pairs)}?)" if pairs else ""


def _outside(low: float, high: float) -> str:
    return f"is outside [{low:g}, {high:g}]"
