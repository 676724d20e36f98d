"""Reading the raw recordings of a cohort: ``subjects.csv`` and ``swe/<subject>.csv``."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from swesbi.context import Context
from swesbi.recording.samples import COLUMNS, FAILED_STATUSES, STATUS_OK, RecordingError, Samples
from swesbi.recording.settings import ContextRow
from swesbi.recording.table import Table, read_table

CONTEXT_COLUMNS = tuple(ContextRow.model_fields)


def read_context_rows(path: Path) -> tuple[ContextRow, ...]:
    """Read ``subjects.csv``: one row a subject, in the file's order; further columns are ignored.

    Raises:
        RecordingError: The table is malformed, a value is impossible or a subject is named twice; the
            message names file, row, column and value.
    """
    table = read_table(path, CONTEXT_COLUMNS)
    table.unique(["subject"])
    for column in CONTEXT_COLUMNS[2:]:
        table.number(column, -float("inf"), float("inf"), "")
    return tuple(_context_row(table, row) for row in range(len(table.cells)))


def read_subjects(path: Path) -> tuple[Context, ...]:
    """Read ``subjects.csv`` as contexts, in the file's order.

    Raises:
        RecordingError: As :func:`read_context_rows`.
    """
    return tuple(row.to_context() for row in read_context_rows(path))


def read_samples(path: Path, phases: int) -> Samples:
    """Read ``swe/<subject>.csv``: one row per attempted push sample; further columns are ignored.

    Args:
        path: The recording.
        phases: Number of gated phases; ``phase_index`` runs from 0 to ``phases - 1``.

    Raises:
        RecordingError: The table is malformed, a value is impossible or a sample is given twice; the
            message names file, row, column and value.
    """
    table = read_table(path, COLUMNS)
    table.unique(["phase_index", "repeat", "sample"])
    return Samples(
        phase_index=table.integer("phase_index", 0, phases - 1, f"this study expects {phases} phases"),
        trigger_delay_ms=table.number("trigger_delay_ms", 0, 5000, "give the delay from the R peak in ms"),
        rr_ms=table.number("rr_ms", 150, 5000, "give the RR interval in ms"),
        repeat=table.integer("repeat", 0, 10_000, "number the repeats of a phase from 0 or 1"),
        sample=table.integer("sample", 0, 1_000_000, "number the samples of a repeat from 0 or 1"),
        speed_m_s=table.number(
            "shear_wave_speed_m_s",
            0.05,
            30,
            "give it in m/s, or leave it empty if it failed",
            may_be_empty=True,
        ),
        fit_r2=table.number("fit_r2", -1, 1, "R2 is a fraction; leave it empty if none", may_be_empty=True),
        status=table.choice("status", (STATUS_OK, *FAILED_STATUSES)),
        source=str(path),
    )


def _context_row(table: Table, row: int) -> ContextRow:
    cells = table.cells.iloc[row]
    values = {name: cells[name] for name in CONTEXT_COLUMNS[:2]}
    numbers = {name: float(cells[name]) for name in CONTEXT_COLUMNS[2:]}
    try:
        return ContextRow.from_plain(values | numbers)
    except ValidationError as error:
        first = error.errors()[0]
        column = str(first["loc"][0]) if first["loc"] else "lvesv_ml"
        raise table.fail(row, column, f"is refused: {first['msg']}; correct the cell (units?)") from error


__all__ = ["RecordingError", "read_context_rows", "read_samples", "read_subjects"]
