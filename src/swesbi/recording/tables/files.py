"""The files that hold a table: by which suffix each is read, and what to do about others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

from swesbi.recording.problems import RecordingError, refusal
from swesbi.recording.tables.columns import EVERY_COLUMN
from swesbi.recording.tables.csv_text import SAVE_AS_CSV, csv_rows, read_csv
from swesbi.recording.tables.layout import OWN_FORM, TableLayout
from swesbi.recording.tables.matlab import read_matlab
from swesbi.recording.tables.table import Row, Table
from swesbi.recording.tables.workbook import read_workbook, sheet_and_rows

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


def open_table(path: Path, layout: TableLayout = OWN_FORM) -> Table:
    """Return the table that a file holds, as it stands there; the last one is kept in memory."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        unknown = f"is none of {', '.join(SUFFIXES)}", "give it in one of these formats"
        raise refusal(path, *OTHERS.get(suffix, unknown))
    try:
        status = path.stat()
        content = status.st_mtime_ns, status.st_size, status.st_ino
        names = tuple(dict.fromkeys((*layout.names, *EVERY_COLUMN)))
        table = _opened(path, content, layout.table.sheet, layout.table.header_row, names)
    except FileNotFoundError as error:
        raise refusal(path, "no such file", "put the file there or correct the path") from error
    except RecordingError:
        raise
    # whatever a library makes of a file that is none: it is this recording's refusal, and no other's
    except Exception as error:
        raise _unreadable(path, error) from error
    return replace(table, problems=[])


def rows_as_they_stand(path: Path) -> list[Row]:
    """Return all rows of a text file or workbook, wherever its names of columns stand."""
    suffix = path.suffix.lower()
    if suffix not in (*TEXT, *EXCEL):
        unknown = "is no text file or workbook", "give a table in one of these formats"
        raise refusal(path, *OTHERS.get(suffix, unknown))
    try:
        return sheet_and_rows(path, None)[1] if suffix in EXCEL else csv_rows(path)
    except RecordingError:
        raise
    except Exception as error:
        raise _unreadable(path, error) from error


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


def _unreadable(path: Path, error: Exception) -> RecordingError:
    return refusal(path, " ".join(f"cannot be read ({type(error).__name__}: {error})".split()), AGAIN)
