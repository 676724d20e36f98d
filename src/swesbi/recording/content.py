"""What a file contains: its bytes, its text, and the rows of CSV in whatever dialect it is written."""

from __future__ import annotations

import csv
import io
import re
import stat
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Final

from swesbi.recording.problems import Problem, RecordingError

MAX_BYTES: Final = 256 * 1024**2
EXCEL_BEGINNINGS: Final = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
DELIMITERS: Final = (",", ";", "\t")
COMMENT: Final = "#"
SNIFFED_ROWS: Final = 50
NUMBER: Final = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
BEGINS_WITH_A_NUMBER: Final = rf"\s*{NUMBER}\s*[,;\t]"
SAVE_AS_CSV: Final = "save the sheet as 'CSV UTF-8' and give that file"


def read_bytes(path: Path) -> bytes:
    """Return the content of a regular file of moderate size.

    Raises:
        RecordingError: There is no such file, it is no regular file, too large, or cannot be read.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise RecordingError(Problem(str(path), "is no regular file", "put the recording itself there"))
        if status.st_size > MAX_BYTES:
            reason = f"has {status.st_size / 1024**2:.0f} MiB, the limit is {MAX_BYTES // 1024**2}"
            raise RecordingError(Problem(str(path), reason, "keep one row per sample, no images or raw data"))
        return path.read_bytes()
    except FileNotFoundError as error:
        remedy = "put the file there or correct the path"
        raise RecordingError(Problem(str(path), "no such file", remedy)) from error
    except OSError as error:
        reason = f"cannot be read ({error.strerror or error})"
        raise RecordingError(Problem(str(path), reason, "check the file's permissions")) from error


def text_of(path: Path) -> str:
    """Return a CSV file as text, its names of columns in a line of their own.

    Raises:
        RecordingError: The file is missing, a workbook, not UTF-8 or no text.
    """
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


def csv_rows(path: Path) -> tuple[tuple[tuple[int, list[str]], ...], bool]:
    """Return the rows of a CSV file of unknown columns, and whether commas in it may be decimal.

    The delimiter is the one that splits most rows into equally many cells: behind semicolons decimal commas
    do that too, but not in the row of names.

    Raises:
        RecordingError: The file is missing, a workbook, not UTF-8 or no CSV.
    """
    text = text_of(path)
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith(COMMENT)]
    delimiter = _by_rows(lines[:SNIFFED_ROWS])
    return records(path, text, delimiter), delimiter != ","


def _by_rows(lines: Sequence[str]) -> str:
    """Return the delimiter that splits most lines into equally many cells."""

    def alike(sign: str) -> tuple[int, int]:
        counts = Counter(map(len, csv.reader(lines, delimiter=sign)))
        for few in (0, 1):
            counts.pop(few, None)
        cells, rows = max(counts.items(), key=lambda item: (item[1], item[0]), default=(0, 0))
        return rows, cells

    return max(DELIMITERS, key=alike)


def delimiter_of(text: str, names: Sequence[str]) -> str:
    """Return the delimiter under which the row of names has most of these."""
    header = next((line for line in text.splitlines() if line.strip() and not line.startswith(COMMENT)), "")
    cells = {sign: {in_one_line(cell).strip('"') for cell in header.split(sign)} for sign in DELIMITERS}
    return max(DELIMITERS, key=lambda sign: len(cells[sign] & set(names)))


def records(path: Path, text: str, delimiter: str) -> tuple[tuple[int, list[str]], ...]:
    """Return the rows that are no comments, each with its place in the file.

    Raises:
        RecordingError: The text is no CSV.
    """
    rows, fault = parsed(text, delimiter)
    if fault:
        row, reason = fault
        raise RecordingError(
            Problem(str(path), f"cannot be read as UTF-8 CSV ({reason})", "save it as such", row=row)
        )
    return rows


@lru_cache(maxsize=1)  # a recording is asked what it is before it is read
def parsed(text: str, delimiter: str) -> tuple[tuple[tuple[int, list[str]], ...], tuple[int, str] | None]:
    """Return the rows of a CSV text, up to the first that is none: with its place and why it is none."""
    places: list[int] = []
    lines: list[str] = []
    for place, line in enumerate(io.StringIO(text, newline=""), start=1):
        if not line.startswith(COMMENT):
            places.append(place)
            lines.append(line)
    reader, rows = csv.reader(lines, delimiter=delimiter), []
    try:
        for cells in reader:
            rows.append((places[reader.line_num - 1], cells))
    except csv.Error as error:
        return tuple(rows), (places[reader.line_num - 1], str(error))
    return tuple(rows), None


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


def in_one_line(name: str) -> str:
    """Return the name of a column without line breaks and needless blanks."""
    return " ".join(name.split())
