"""CSV in whatever dialect it is written: its bytes, its text, its rows, the table that it is."""

from __future__ import annotations

import csv
import io
import re
import stat
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from swesbi.recording.problems import Problem, RecordingError, refusal
from swesbi.recording.tables.table import HEADER, NUMBER, SHOWN_ROWS, Row, Table, table_of

MAX_BYTES: Final = 256 * 1024**2
EXCEL_BEGINNINGS: Final = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
DELIMITERS: Final = (",", ";", "\t")
COMMENT: Final = "#"
SNIFFED_ROWS: Final = 50
BEGINS_WITH_A_NUMBER: Final = rf"\s*{NUMBER}\s*[,;\t]"
SAVE_AS_CSV: Final = "save the sheet as 'CSV UTF-8' and give that file"
OPEN_QUOTE: Final = "has a quote that opens a cell and does not close it in the same row"
BEHIND_QUOTE: Final = "has text behind a closing quote"
CLOSE_QUOTE: Final = "remove the quote, or double it within a cell; no cell may span rows"


def read_bytes(path: Path) -> bytes:
    """Return the content of a regular file of moderate size."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise refusal(path, "is no regular file", "put the recording itself there")
        if status.st_size > MAX_BYTES:
            raise refusal(
                path,
                f"has {status.st_size / 1024**2:.0f} MiB, the limit is {MAX_BYTES // 1024**2}",
                "keep one row per sample, no images or raw data",
            )
        return path.read_bytes()
    except FileNotFoundError as error:
        raise refusal(path, "no such file", "put the file there or correct the path") from error
    except OSError as error:
        raise refusal(
            path, f"cannot be read ({error.strerror or error})", "check the file's permissions"
        ) from error


def read_csv(path: Path, header_row: int = 1) -> Table:
    """Return the table of a CSV file below its row of names; lines from ``#`` on are comments.

    No row before ``header_row`` is read. Behind semicolon and tab, a comma within a number is a decimal
    comma.
    """
    text = text_of(path)
    delimiter = _delimiter(text)
    below = [(place, cells) for place, cells in records(path, text, delimiter) if place >= header_row]
    table = table_of(str(path), below, HEADER, decimal_comma=delimiter != ",")
    return replace(table, left_out=_rows_as_comments(text, table, delimiter))


def _rows_as_comments(text: str, table: Table, delimiter: str) -> tuple[str, ...]:
    """Name the comments below the names of columns that have as many cells as these."""
    size = len(table.cells)
    rows = [
        str(place)
        for place, line in enumerate(text.splitlines(), start=1)
        if place > table.header_row and line.startswith(COMMENT) and len(line.split(delimiter)) == size > 1
    ]
    more = f", and {len(rows) - SHOWN_ROWS} more" if len(rows) > SHOWN_ROWS else ""
    told = f"rows that begin with # are left out: {', '.join(rows[:SHOWN_ROWS])}{more}"
    return (told,) if rows else ()


def csv_rows(path: Path) -> list[Row]:
    """Return the rows of a CSV file, each with its place."""
    text = text_of(path)
    return records(path, text, _delimiter(text))


def _delimiter(text: str) -> str:
    """Return the delimiter of a text's first lines that are no comments."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith(COMMENT)]
    return delimiter_of(lines[:SNIFFED_ROWS])


def text_of(path: Path) -> str:
    """Return a CSV file as text, its names of columns in a line of their own."""
    content = read_bytes(path)
    if content.startswith(EXCEL_BEGINNINGS):
        raise RecordingError(Problem(str(path), "is an Excel workbook", SAVE_AS_CSV))
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        reason = f"cannot be read as UTF-8 text (byte {error.start + 1})"
        raise RecordingError(Problem(str(path), reason, "save it as CSV in UTF-8")) from error
    if "\0" in text:
        raise RecordingError(Problem(str(path), "holds zero bytes, so is no text", "save it as CSV in UTF-8"))
    return _with_plain_names(text)


def delimiter_of(lines: Sequence[str]) -> str:
    """Return the delimiter that splits most lines into equally many cells.

    Behind semicolons decimal commas do that too, but not in the row of names.
    """
    bare = [re.sub(r'"[^"]*"', "", line) for line in lines]

    def alike(sign: str) -> tuple[int, int]:
        counts = Counter(line.count(sign) for line in bare if sign in line)
        return max(((rows, signs) for signs, rows in counts.items()), default=(0, 0))

    return max(DELIMITERS, key=alike)


def records(path: Path, text: str, delimiter: str) -> list[Row]:
    """Return the rows that are no comments, each with its place in the file; no cell may span rows."""
    lines = [
        (place, line)
        for place, line in enumerate(io.StringIO(text, newline=""), start=1)
        if not line.startswith(COMMENT)
    ]
    reader = csv.reader((line for _, line in lines), delimiter=delimiter, strict=True)
    rows: list[Row] = []
    try:
        for cells in reader:
            if reader.line_num > len(rows) + 1:
                raise csv.Error(OPEN_QUOTE)
            rows.append((lines[reader.line_num - 1][0], cells))
    except csv.Error as error:
        spans = str(error) == "unexpected end of data" or reader.line_num > len(rows) + 1
        behind = str(error) == f"'{delimiter}' expected after '\"'"
        reason = OPEN_QUOTE if spans else BEHIND_QUOTE if behind else f"cannot be read as CSV ({error})"
        remedy = CLOSE_QUOTE if spans or behind else "shorten its cells, or save it as CSV again"
        raise refusal(path, reason, remedy, row=lines[len(rows)][0]) from error
    return rows


def _with_plain_names(text: str) -> str:
    """Return a text whose names of columns stand in a line of their own: neither behind ``#`` nor ``sep=``.

    Where the first line that is no comment begins with a number, the comment before it names the columns.
    Excel's line on the delimiter becomes a comment. Lines keep their places.
    """
    lines = text.splitlines(keepends=True)
    if lines and lines[0].lower().startswith("sep="):
        lines[0] = COMMENT + lines[0]
    first = next(
        (place for place, line in enumerate(lines) if line.strip() and not line.startswith(COMMENT)), 0
    )
    before = lines[first - 1] if first else ""
    if (
        before.startswith(COMMENT)
        and re.match(BEGINS_WITH_A_NUMBER, lines[first])
        and any(before.count(sign) == lines[first].count(sign) > 0 for sign in DELIMITERS)
    ):
        lines[first - 1] = before.lstrip(f"{COMMENT} ")
    return "".join(lines)
