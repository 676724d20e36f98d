"""Sheets of Excel workbooks as text, row by row, as a CSV file would have them."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.table import MAX_BYTES, read_bytes, shortest

if TYPE_CHECKING:
    from openpyxl.workbook.workbook import Workbook

SAVE_AGAIN: Final = "open it in a spreadsheet program and save it as .xlsx, or as 'CSV UTF-8'"
MOST_CELLS: Final = 5_000_000


def sheet_rows(path: Path, sheet: str | None) -> list[tuple[int, list[str]]]:
    """Return the rows of a sheet that are not empty, each with its number; numbers as their shortest text.

    Args:
        path: An .xlsx or .xlsm file.
        sheet: Name of the sheet; None: the only one with content.

    Raises:
        RecordingError: The file is missing or no such workbook, has no such sheet or more than one, or has
            a formula without a computed value.
    """
    content = read_bytes(path)
    values, formulas = (_opened(path, content, data_only) for data_only in (True, False))
    name = _chosen(path, values, sheet)
    rows = []
    for (number, cells), (_, written) in zip(_rows(values, name), _rows(formulas, name), strict=True):
        for column, (cell, formula) in enumerate(zip(cells, written, strict=True), start=1):
            if cell is None and isinstance(formula, str) and formula.startswith("="):
                reason = "is a formula whose value was never computed"
                raise RecordingError(
                    Problem(str(path), reason, SAVE_AGAIN, number, f"number {column}", formula)
                )
        if any(cell is not None for cell in cells):
            rows.append((number, [_as_text(cell) for cell in cells]))
    return rows


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


def _rows(book: Workbook, sheet: str) -> Iterator[tuple[int, tuple[Any, ...]]]:
    yield from enumerate(book[sheet].iter_rows(values_only=True), start=1)


def _as_text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool) or not isinstance(cell, int | float):
        return str(cell).strip()
    return shortest(float(cell))
