"""Tables as a workbook of Excel, the same bytes for the same tables."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pandas as pd

from swesbi.artefacts import atomic_path

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

EPOCH: Final = (1980, 1, 1, 0, 0, 0)
"""The first date that a ZIP archive knows; stands where openpyxl writes the time of writing."""
CORE: Final = "docProps/core.xml"
DATES: Final = re.compile(rb">\d{4}-\d\d-\d\dT[\d:]+Z<")
WIDEST: Final = 60


def write_workbook(path: Path, sheets: Mapping[str, pd.DataFrame]) -> None:
    """Write tables as sheets: names in bold, which stay in view; what is missing is an empty cell."""
    from openpyxl import Workbook  # a third of a second, for this alone

    book = Workbook()
    book.remove(book.worksheets[0])
    for name, table in sheets.items():
        _fill(book.create_sheet(name), table)
    written = io.BytesIO()
    book.save(written)
    with atomic_path(path) as temporary:
        temporary.write_bytes(_undated(written.getvalue()))


def _fill(sheet: Worksheet, table: pd.DataFrame) -> None:
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    cells = table.astype(object).where(table.notna(), None)
    sheet.append(list(map(str, table.columns)))
    for values in cells.to_numpy().tolist():
        sheet.append(values)
    for row in sheet.iter_rows():
        for cell in row:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # a text that begins with = is no formula
    for number, name in enumerate(table.columns, start=1):
        sheet.cell(1, number).font = Font(bold=True)
        longest = max(map(len, map(str, [name, *table[name].dropna()])))
        sheet.column_dimensions[get_column_letter(number)].width = min(longest, WIDEST) + 2
    sheet.freeze_panes = "B2"


def _undated(content: bytes) -> bytes:
    """Return a workbook without the time of its writing."""
    undated = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as dated,
        zipfile.ZipFile(undated, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name in dated.namelist():
            member = dated.read(name)
            bare = DATES.sub(rb">1980-01-01T00:00:00Z<", member) if name == CORE else member
            archive.writestr(zipfile.ZipInfo(name, EPOCH), bare, zipfile.ZIP_DEFLATED)
    return undated.getvalue()
