"""The project's own tables as CSV: written atomically, read back as they were, and checked."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import pandas as pd

from swesbi.artefacts.atomic import ArtefactError, atomic_path

DIGITS: Final = 8
NAMES: Final = ("subject", "person", "visit", "from_visit", "to_visit", "group", "of", "experiment")
"""Columns that hold names, which others give: always texts, also where they look like numbers."""
NUMBER: Final = re.compile(r"[+-]?(inf|[\d.]+(e[+-]?\d+)?( ± [\d.]+)?)( \([\w ]+\))?", re.IGNORECASE)
FORMULA: Final = re.compile(r"'*[=+\-@].", re.DOTALL)
QUOTED: Final = re.compile(r"'+[=+\-@].", re.DOTALL)


@dataclass(frozen=True)
class Table:
    """What is asked of a table of the project's own: ``Annotated[pd.DataFrame, Table()]`` is one.

    It must have ``columns``, among others perhaps, and a row where ``row`` says what one is ("epoch").
    ``texts`` are columns of texts beside those of names. Without ``digits`` numbers have all of theirs.
    """

    columns: tuple[str, ...] = ()
    texts: tuple[str, ...] = ()
    row: str = ""
    digits: int | None = DIGITS

    def read(self, path: Path) -> pd.DataFrame:
        """Read a table."""
        try:
            table = read_csv(path, self.texts)
        except (OSError, ValueError) as error:
            raise ArtefactError(f"{path}: cannot be read as a table ({error})") from error
        if missing := [name for name in self.columns if name not in table.columns]:
            raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}; delete it and rerun")
        if self.row and table.empty:
            raise ArtefactError(f"{path}: holds no {self.row}; delete it and rerun")
        return table

    def write(self, table: pd.DataFrame, path: Path) -> None:
        """Write a table, whole or not at all."""
        write_csv(path, table, self.digits)


PlainTable = Annotated[pd.DataFrame, Table()]
"""Any table, its numbers to eight digits."""
WholeTable = Annotated[pd.DataFrame, Table(digits=None)]
"""Any table, its numbers as they are."""


def write_csv(path: Path, table: pd.DataFrame, digits: int | None = DIGITS) -> None:
    """Write a table atomically, without its index; NaN becomes an empty field.

    A text that spreadsheets would take for a formula (``=1+1``) gets an apostrophe before it.
    """
    shown = None if digits is None else f"%.{digits}g"
    with atomic_path(path) as temporary:
        _each_text(table, _written).to_csv(temporary, index=False, float_format=shown, lineterminator="\n")


def read_csv(path: Path, texts: Sequence[str] = ()) -> pd.DataFrame:
    """Read a table of the project's own.

    Columns of names (``NAMES``) and ``texts``, which it need not have, hold texts: ``NA`` and ``007`` stay as
    they are, and an empty cell is an empty text. Another column holds numbers where all its filled cells are
    numbers, or truth values; what is empty there is NaN.
    """
    columns = dict.fromkeys([*NAMES, *texts], str)
    table = pd.read_csv(path, dtype=columns, keep_default_na=False, na_values=[""])
    return _each_text(table.fillna(dict.fromkeys(columns, "")), _as_given)


def _each_text(table: pd.DataFrame, change: Callable[[str], str]) -> pd.DataFrame:
    """Return the table with its texts changed; what else stands in columns of texts stays."""
    changed: dict[str, pd.Series[str]] = {}
    for name, column in table.items():
        if column.dtype.kind == "O":
            cells = [change(cell) if isinstance(cell, str) else cell for cell in column]
            changed[str(name)] = pd.Series(cells, table.index, column.dtype)
    return table.assign(**changed)


def _written(text: str) -> str:
    return f"'{text}" if FORMULA.match(text) and not NUMBER.fullmatch(text) else text


def _as_given(text: str) -> str:
    return text[1:] if QUOTED.match(text) else text
