"""Where a table comes from: a file by its suffix, or a DataFrame or arrays in memory, as strict as a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from swesbi.recording.problems import RecordingError, refusal
from swesbi.recording.tables.csv_text import SAVE_AS_CSV, csv_rows, read_csv
from swesbi.recording.tables.layout import EVERY_COLUMN, OWN_FORM, TableLayout
from swesbi.recording.tables.matlab import read_matlab
from swesbi.recording.tables.table import Row, Table, shortest, table_of
from swesbi.recording.tables.workbook import read_workbook, sheet_and_rows

if TYPE_CHECKING:
    import pandas as pd

TEXT: Final = (".csv", ".tsv", ".txt")
EXCEL: Final = (".xlsx", ".xlsm")
MATLAB: Final = ".mat"
SUFFIXES: Final = (*TEXT, MATLAB, *EXCEL)
BY_PANDAS: Final = "read it in Python, by swesbi.recording_from_table (docs/own-data.md), or save it as CSV"
OTHERS: Final[Mapping[str, tuple[str, str]]] = {
    **dict.fromkeys((".xls", ".xlsb", ".ods", ".numbers", ".gsheet"), ("is a workbook", SAVE_AS_CSV)),
    **dict.fromkeys(
        (".dta", ".sav", ".sas7bdat", ".rds", ".rdata"), ("is of a statistics program", BY_PANDAS)
    ),
    **dict.fromkeys((".parquet", ".feather", ".json", ".h5", ".hdf5", ".npz"), ("is no table", BY_PANDAS)),
    **dict.fromkeys((".zip", ".gz", ".bz2", ".xz", ".7z"), ("is packed", "unpack it")),
}
"""Suffixes of files that are not read: what they are, and what to do."""
AGAIN: Final = "save it again, or as CSV"
COLUMNS = "name its columns as those of a file: texts, each once"


def open_table(path: Path, layout: TableLayout = OWN_FORM) -> Table:
    """Return the table that a file holds, as it stands there; the last one is kept in memory."""
    with _reading(path, SUFFIXES, f"is none of {', '.join(SUFFIXES)}", "give it in one of these formats"):
        status = path.stat()
        content = status.st_mtime_ns, status.st_size, status.st_ino
        names = tuple(dict.fromkeys((*layout.names, *EVERY_COLUMN)))
        table = _opened(path, content, layout.table.sheet, layout.table.header_row, names)
    return replace(table, problems=[])


def rows_as_they_stand(path: Path) -> list[Row]:
    """Return all rows of a text file or workbook, wherever its names of columns stand."""
    with _reading(
        path, (*TEXT, *EXCEL), "is no text file or workbook", "give a table in one of these formats"
    ):
        return sheet_and_rows(path, None)[1] if path.suffix.lower() in EXCEL else csv_rows(path)


@contextmanager
def _reading(path: Path, suffixes: Sequence[str], reason: str, remedy: str) -> Iterator[None]:
    """Refuse a file of another suffix, one that is not there, and one that its library does not read."""
    suffix = path.suffix.lower()
    if suffix not in suffixes:
        raise refusal(path, *OTHERS.get(suffix, (reason, remedy)))
    try:
        yield
    except FileNotFoundError as error:
        raise refusal(path, "no such file", "put the file there or correct the path") from error
    except RecordingError:
        raise
    # whatever a library makes of a file that is none: it is this recording's refusal, and no other's
    except Exception as error:
        what = " ".join(f"cannot be read ({type(error).__name__}: {error})".split())
        raise refusal(path, what, AGAIN) from error


@lru_cache(
    maxsize=1
)  # a recording is asked what it is before it is read, and one table may be of many subjects
def _opened(
    path: Path, content: tuple[int, ...], sheet: str | None, header_row: int, names: tuple[str, ...]
) -> Table:
    """Read a file; ``content`` changes where it does."""
    suffix = path.suffix.lower()
    if suffix in EXCEL:
        return read_workbook(path, sheet, header_row)
    return read_matlab(path, names) if suffix == MATLAB else read_csv(path, header_row)


def table_of_frame(frame: pd.DataFrame, source: str) -> Table:
    """Return a DataFrame as a table; its rows count from 1, and an index with a name is a column."""
    if frame.columns.nlevels > 1:
        raise refusal(source, "has names of columns in several levels", COLUMNS)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    header = [str(name) for name in frame.columns]
    rows = [list(map(_as_text, row)) for row in frame.itertuples(index=False, name=None)]
    return table_of(source, [(0, header), *enumerate(rows, start=1)], COLUMNS)


def table_of_arrays(arrays: Mapping[str, Any], source: str) -> Table:
    """Return arrays of one length, by the columns that they are; None is left out."""
    import pandas as pd

    given = {name: np.asarray(values) for name, values in arrays.items() if values is not None}
    for name, values in given.items():
        if values.ndim != 1:
            raise refusal(
                source, f"is an array of {values.ndim} dimensions", "give one value a push", column=name
            )
    sizes = {name: len(values) for name, values in given.items()}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise refusal(source, f"its arrays differ in length ({listed})", "give every push a value in each")
    return table_of_frame(pd.DataFrame(given), source)


def _as_text(value: object) -> str:
    """Return a cell as a file would have it: nothing for what is missing."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        missing = value is None or value != value or repr(value) == "<NA>"  # noqa: PLR0124
        return "" if missing else str(value)
    return "" if np.isnan(value) else shortest(float(value))
