"""Sheets of Excel workbooks as text, row by row, as a CSV file would have them."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from decimal import Decimal
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swesbi.recording.content import MAX_BYTES, read_bytes
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.table import shortest

if TYPE_CHECKING:
    from openpyxl.cell.cell import Cell, MergedCell
    from openpyxl.workbook.workbook import Workbook
    from openpyxl.worksheet.worksheet import Worksheet

SAVE_AGAIN: Final = "open it in a spreadsheet program and save it as .xlsx, or as 'CSV UTF-8'"
MOST_CELLS: Final = 5_000_000


def sheet_rows(path: Path, sheet: str | None) -> list[tuple[int, list[str]]]:
    """Return the rows of a sheet that are not empty, each with its number; numbers as their shortest text.

    Args:
        path: An .xlsx or .xlsm file.
        sheet: Name of the sheet; None: the only one with content.

    Raises:
        RecordingError: The file is missing or no such workbook, has no such sheet or more than one, has
            hidden rows, or a formula without a computed value.
    """
    return _rows_of(path, read_bytes(path), sheet)


@lru_cache(maxsize=1)  # a recording is asked what it is before it is read
def _rows_of(path: Path, content: bytes, sheet: str | None) -> list[tuple[int, list[str]]]:
    values, formulas = (_opened(path, content, data_only) for data_only in (True, False))
    shown = values[_chosen(path, values, sheet)]
    _check_computed(path, shown, formulas[shown.title])
    _fill_merged(shown)
    rows = [
        (number, [_as_text(cell) for cell in cells])
        for number, cells in enumerate(shown.iter_rows(), start=1)
        if any(cell.value is not None for cell in cells)
    ]
    _check_hidden(path, shown, [number for number, _ in rows])
    return rows


def _check_computed(path: Path, shown: Worksheet, written: Worksheet) -> None:
    """Refuse a formula whose value nobody has computed."""
    for values, formulas in zip(shown.iter_rows(), written.iter_rows(), strict=True):
        for cell, formula in zip(values, formulas, strict=True):
            text = formula.value
            if cell.value is None and isinstance(text, str) and text.startswith("="):
                reason = "is a formula whose value was never computed"
                place = f"number {cell.column}"
                raise RecordingError(Problem(str(path), reason, SAVE_AGAIN, cell.row, place, text))


def _check_hidden(path: Path, shown: Worksheet, filled: Sequence[int]) -> None:
    """Refuse hidden rows with content: a filter hides what somebody meant to leave out, or forgot."""
    hidden = [row for row in filled if shown.row_dimensions[row].hidden]
    if hidden:
        reason = f"has {len(hidden)} hidden rows with content, the first of them {hidden[0]}"
        remedy = "delete what is not meant, or clear the filter, and save it again"
        raise RecordingError(Problem(str(path), reason, remedy))


def _fill_merged(shown: Worksheet) -> None:
    """Give every cell of a merged column the value that is seen over all of them."""
    for merged in [one for one in shown.merged_cells.ranges if one.min_col == one.max_col]:
        value = shown.cell(merged.min_row, merged.min_col).value
        column, rows = merged.min_col, range(merged.min_row, merged.max_row + 1)
        shown.unmerge_cells(merged.coord)
        for row in rows:
            shown.cell(row, column).value = value


def _opened(path: Path, content: bytes, data_only: bool) -> Workbook:
    from openpyxl import load_workbook

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(member.file_size for member in archive.infolist()) > MAX_BYTES:
                raise ValueError(f"holds more than {MAX_BYTES // 1024**2} MiB")
        return load_workbook(io.BytesIO(content), data_only=data_only)
    # openpyxl raises whatever the broken part of a file makes it raise
    except Exception as error:
        reason = " ".join(f"cannot be read as a workbook ({error})".split())
        raise RecordingError(Problem(str(path), reason, SAVE_AGAIN)) from error


def _chosen(path: Path, book: Workbook, sheet: str | None) -> str:
    names = [each.title for each in book.worksheets]
    if any(each.max_row * each.max_column > MOST_CELLS for each in book.worksheets):
        raise RecordingError(Problem(str(path), f"has a sheet of more than {MOST_CELLS} cells", SAVE_AGAIN))
    if sheet is not None:
        if sheet not in names:
            remedy = "correct the key `table.sheet` of recording.yaml"
            reason = f"is no sheet of the workbook, which has {', '.join(names)}"
            raise RecordingError(Problem(str(path), reason, remedy, value=sheet))
        return sheet
    filled = [each.title for each in book.worksheets if each.max_row > 1]
    if len(filled) != 1:
        reason = f"has {len(filled)} sheets with rows: {', '.join(filled) or 'none'}"
        remedy = "name the one that counts under the key `table.sheet` of recording.yaml"
        raise RecordingError(Problem(str(path), reason, remedy))
    return filled[0]


def _as_text(cell: Cell | MergedCell) -> str:
    """Return a cell as it is seen: a number with a per cent format has its sign."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).strip()
    if "%" in str(cell.number_format):
        return f"{format((100 * Decimal(shortest(float(value)))).normalize(), 'f')}%"
    return shortest(float(value))
