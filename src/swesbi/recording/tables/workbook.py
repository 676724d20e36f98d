"""Sheets of Excel workbooks as tables of what is seen in them."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swesbi.recording.problems import Problem, RecordingError, refusal
from swesbi.recording.tables.csv_text import EXCEL_BEGINNINGS, MAX_BYTES, read_bytes
from swesbi.recording.tables.table import HEADER, Row, Table, in_one_line, shortest, table_of

if TYPE_CHECKING:
    from openpyxl.cell.cell import Cell, MergedCell
    from openpyxl.workbook.workbook import Workbook
    from openpyxl.worksheet.worksheet import Worksheet

SAVE_AGAIN: Final = "open it in a spreadsheet program and save it as .xlsx, or as 'CSV UTF-8'"
MOST_CELLS: Final = 500_000
STRICT: Final = b"http://purl.oclc.org/ooxml/spreadsheetml/main"
MERGED: Final = re.compile(rb'<(?:\w+:)?mergeCell\b[^>]*\bref="([A-Z]+)([0-9]+):([A-Z]+)([0-9]+)"')
CELL: Final = re.compile(rb"<(?:\w+:)?c[ />]")
FORMULA: Final = re.compile(rb"<(?:\w+:)?f[ />]")
LONGEST: Final = 60
"""Characters of a note that are shown."""
PLACED: Final = re.compile(rb'<(?:\w+:)?(?:c|row)\b[^>]*\br="([A-Z]*)([0-9]+)"')
SHOWN_AS_IT_IS: Final = re.compile(r'\[[^\]]*\]|[_*\\].|"[^"]*"')
"""Of a number format: colours and conditions, padding, signs and texts that are shown as they stand."""


def read_workbook(path: Path, sheet: str | None, header_row: int = 1) -> Table:
    """Return a sheet's table, numbers as their shortest text; hidden and struck columns are closed.

    No row before ``header_row`` is read; without a ``sheet`` it is the only one with content. Refused are
    hidden rows, and formulas without a computed value.
    """
    shown, rows = sheet_and_rows(path, sheet)
    _check_hidden_rows(path, shown, [number for number, _ in rows])
    below = [(number, cells) for number, cells in rows if number >= header_row]
    table = table_of(str(path), below, HEADER)
    return replace(table, closed=dict(_closed(path, shown, table)), left_out=_notes(shown))


def sheet_and_rows(path: Path, sheet: str | None) -> tuple[Worksheet, list[Row]]:
    """Return a sheet, without a name the only one with content, and its rows that are not empty."""
    content = read_bytes(path)
    has_formulas = _check_size(path, content)
    values = _opened(path, content, data_only=True)
    shown = values[_chosen(path, values, sheet)]
    if has_formulas:
        _check_computed(path, shown, _opened(path, content, data_only=False)[shown.title])
    rows = [
        (number, [_as_text(cell) for cell in cells])
        for number, cells in enumerate(shown.iter_rows(), start=1)
        if any(cell.value is not None for cell in cells)
    ]
    return shown, rows


def _check_size(path: Path, content: bytes) -> bool:
    """Refuse what is no workbook of moderate size, before a cell is made; tell whether it has formulas."""
    if content.startswith(EXCEL_BEGINNINGS[1]):
        raise refusal(
            path,
            "is a workbook of the old form, or one that a password protects",
            "save it without a password as .xlsx",
        )
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > MAX_BYTES:
                raise ValueError(f"holds more than {MAX_BYTES // 1024**2} MiB")
            parts = {one.filename: archive.read(one) for one in members if one.filename.endswith(".xml")}
    except (ValueError, OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise _unreadable(path, error) from error
    if any(STRICT in part for name, part in parts.items() if name.startswith("xl/workbook")):
        raise refusal(
            path, "is a 'Strict Open XML Spreadsheet'", "save it as 'Excel Workbook (.xlsx)', or as CSV"
        )
    for name, part in parts.items():
        if "/worksheets/" in name and _cells_of(part) > MOST_CELLS:
            raise refusal(
                path,
                f"has a sheet of more than {MOST_CELLS} cells, merged ones counted",
                "save the sheet as 'CSV UTF-8'",
            )
    return any(FORMULA.search(part) for name, part in parts.items() if "/worksheets/" in name)


def _cells_of(sheet: bytes) -> int:
    """Return how many cells a sheet has or spans, whichever is more: those of merged ranges are made too."""
    merged = sum(
        (_column(last) - _column(first) + 1) * (int(below) - int(above) + 1)
        for first, above, last, below in MERGED.findall(sheet)
    )
    places = [(_column(letters), int(row)) for letters, row in PLACED.findall(sheet)]
    columns, rows = (max((place[axis] for place in places), default=0) for axis in (0, 1))
    return max(merged, len(CELL.findall(sheet)), max(columns, 1) * rows)


def _column(letters: bytes) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + letter - ord("A") + 1
    return number


def _opened(path: Path, content: bytes, data_only: bool) -> Workbook:
    from openpyxl import load_workbook

    try:
        return load_workbook(io.BytesIO(content), data_only=data_only)
    # openpyxl raises whatever the broken part of a file makes it raise
    except Exception as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> RecordingError:
    return refusal(path, " ".join(f"cannot be read as a workbook ({error})".split()), SAVE_AGAIN)


def _chosen(path: Path, book: Workbook, sheet: str | None) -> str:
    names = [each.title for each in book.worksheets]
    if sheet is not None:
        if sheet not in names:
            raise refusal(
                path,
                f"is no sheet of the workbook, which has {', '.join(names)}",
                "correct the key `table.sheet` of recording.yaml",
                value=sheet,
            )
        return sheet
    filled = [each.title for each in book.worksheets if each.max_row > 1]
    if len(filled) != 1:
        raise refusal(
            path,
            f"has {len(filled)} sheets with rows: {', '.join(filled) or 'none'}",
            "name the one that counts under the key `table.sheet` of recording.yaml",
        )
    return filled[0]


def _check_computed(path: Path, shown: Worksheet, written: Worksheet) -> None:
    """Refuse a formula whose value nobody has computed."""
    for values, formulas in zip(shown.iter_rows(), written.iter_rows(), strict=True):
        for cell, formula in zip(values, formulas, strict=True):
            text = formula.value
            if cell.value is None and isinstance(text, str) and text.startswith("="):
                reason = "is a formula whose value was never computed"
                place = f"number {cell.column}"
                raise refusal(path, reason, SAVE_AGAIN, cell.row, place, text)


def _check_hidden_rows(path: Path, shown: Worksheet, filled: Sequence[int]) -> None:
    """Refuse hidden rows with content: a filter hides what somebody meant to leave out, or forgot."""
    hidden = [row for row in filled if shown.row_dimensions[row].hidden]
    if hidden:
        raise refusal(
            path,
            f"has {len(hidden)} hidden rows with content, the first of them {hidden[0]}",
            "delete what is not meant, or clear the filter, and save it again",
        )


def _closed(path: Path, shown: Worksheet, table: Table) -> Iterator[tuple[str, Problem]]:
    """Yield the columns in which something is seen otherwise than it is stored, and what."""
    hidden = {
        number
        for dimension in shown.column_dimensions.values()
        if dimension.hidden or dimension.width == 0
        for number in range(dimension.min or 0, (dimension.max or 0) + 1)
    }
    merged = {
        number: one.min_row
        for one in shown.merged_cells.ranges
        if one.max_row >= table.header_row
        for number in range(one.min_col, one.max_col + 1)
    }
    for cell in next(shown.iter_rows(min_row=table.header_row, max_row=table.header_row)):
        name, number = in_one_line(_as_text(cell)) or f"column {cell.column}", int(cell.column or 0)
        if number in hidden:
            remedy = "delete the column, or show it, and save the workbook again"
            yield (name, Problem(str(path), "is hidden", remedy, column=name))
        elif number in merged:
            remedy = "unmerge them, and write the value into every row"
            yield (name, Problem(str(path), "has merged cells", remedy, merged[number], name))
        else:
            marked = ((row, _mark(shown.cell(row, number))) for row in table.rows.tolist())
            if found := next(((row, mark) for row, mark in marked if mark), None):
                row, (reason, remedy) = found
                text = _as_text(shown.cell(row, number))
                yield name, Problem(str(path), reason, remedy, row, name, text)


def _mark(cell: Cell | MergedCell) -> tuple[str, str] | None:
    """Return by which mark a cell is not meant, or not seen, and what to do."""
    if cell.value is None:
        return None
    if cell.font and cell.font.strike:
        return "is struck through", "delete the row, or clear the line through it"
    if not isinstance(cell.value, str) and str(cell.number_format).startswith(";"):
        return "is hidden by its number format", "delete the value, or give it a format that shows it"
    return None


def _notes(shown: Worksheet) -> tuple[str, ...]:
    """Name the notes at cells, which nobody reads."""
    found = [(cell.coordinate, cell.comment) for cells in shown.iter_rows() for cell in cells if cell.comment]
    if not found:
        return ()
    place, first = found[0]
    more = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return (f"notes at cells are not read: {place} {' '.join(first.text.split())[:LONGEST]!r}{more}",)


def _as_text(cell: Cell | MergedCell) -> str:
    """Return a cell as it is seen, to all its digits: with the sign or the words that its format adds."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).strip()
    number_format = str(cell.number_format).split(";", maxsplit=1)[0]
    bare = SHOWN_AS_IT_IS.sub("", number_format)
    added = "".join(re.findall(r'"([^"]*)"', number_format) + re.findall(r"\\(.)", number_format)).rstrip()
    text, hundreds = shortest(float(value)), bare.count("%")
    thousands = sum(map(len, re.findall(r"(?<=[0#?]),+(?![0#?])", bare)))
    if hundreds or thousands:
        scaled = Decimal(text) * Decimal(100) ** hundreds / Decimal(1000) ** thousands
        text = format(scaled.normalize(), "f")
    return f"{text}{'%' if hundreds else ''}{added}"
