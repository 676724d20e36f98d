"""Reading the raw samples of one subject: ``swe/<subject>.csv`` or ``swe/<subject>.mat``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.recording.cohort import EXCEL, SUFFIXES, WORKBOOKS
from swesbi.recording.columns import EVENT, FAILED_STATUSES, MODULUS, SPEED, STATUS_OK
from swesbi.recording.content import SAVE_AS_CSV
from swesbi.recording.foreign import GATED, Wanted, has_no_phases, placed_by, read_foreign
from swesbi.recording.groups import grouped
from swesbi.recording.layout import TableLayout
from swesbi.recording.mat_table import read_mat_table
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.speed import shear_wave_speed_m_s, youngs_modulus_kpa
from swesbi.recording.table import TextTable, read_table

MEASURED: Final = (SPEED, MODULUS)
READERS: Final = {".csv": read_table, ".mat": read_mat_table}
OWN_FORM: Final = TableLayout()
NOT_GATED: Final = "is free-running: it has instants (time_ms) and no phases (phase_index)"
ASK_FREE: Final = (
    "networks and the experiments of the paper need gated phases; `swesbi infer` answers it without a "
    "network; in a study's own cohort leave it out of `subjects`"
)
EVENT_HERE: Final = "says what set off each wave"
NO_EVENT: Final = (
    "natural waves are not interpreted: leave them out; a table of pushes goes without this column"
)
OTHER_GATE: Final = 0.85  # of the distance of two gates; samples binned by phase lie within one
SAME_GATE: Final = "correct the label or the delay; a label stands for one gate, in every repeat"
SPEED_RANGE_M_S: Final = (0.05, 30.0)


def read_samples(
    path: Path,
    phases: int,
    density_kg_m3: float,
    layout: TableLayout = OWN_FORM,
    subject: str = "",
) -> Samples:
    """Read one row (CSV, workbook) or element (.mat) per attempted push sample; further columns are ignored.

    A recording has either the column ``shear_wave_speed_m_s`` or, in its place, ``youngs_modulus_kpa``, of
    which each value E becomes the speed sqrt(E / (3 rho)).

    Args:
        path: The recording; its suffix tells the format.
        phases: Number of gated phases; ``phase_index`` runs from 0 to ``phases - 1``.
        density_kg_m3: Density rho behind a Young's modulus.
        layout: How the cohort's tables differ from this project's form, by its ``recording.yaml``.
        subject: Whose rows are wanted of a table of several.

    Raises:
        RecordingError: The table is malformed, a value is impossible or a sample is given twice; it lists
            every problem with file, row, column and value.

    Returns:
        The samples by phase, repeat and sample, whatever the order of the rows.
    """
    places = placed_by(path, layout)
    if has_no_phases(places):
        raise RecordingError(Problem(str(path), NOT_GATED, ASK_FREE))
    if EVENT in places:
        raise RecordingError(Problem(str(path), EVENT_HERE, NO_EVENT, column=EVENT))
    return _in_order(samples_of(read_columns(path, layout, subject), phases, density_kg_m3))


def _in_order(samples: Samples) -> Samples:
    order = np.lexsort((samples.sample, samples.repeat, samples.phase_index))
    columns = {name: value[order] for name, value in vars(samples).items() if name != "source"}
    return replace(samples, **columns)


def samples_of(table: TextTable, phases: int, density_kg_m3: float) -> Samples:
    """Read the columns of a gated recording cell by cell.

    Args:
        table: Of :func:`read_columns`.
        phases: Number of gated phases.
        density_kg_m3: Density rho behind a Young's modulus.

    Raises:
        RecordingError: A value is impossible, a sample is given twice, or a row lies at another gate than
            its phase.
    """
    table.unique(["phase_index", "repeat", "sample"])
    phase_index = _phase_index(table, phases)
    delay = table.number("trigger_delay_ms", 0, 5000, "give the delay from the R peak in ms")
    rr = read_rr_ms(table)
    repeat = table.integer("repeat", 0, 10_000, "number the repeats of a phase from 0 or 1")
    sample = table.integer("sample", 0, 1_000_000, "number the samples of a repeat from 0 or 1")
    speed = read_speed(table, density_kg_m3)
    r2, status = read_fit_r2(table), read_status(table)
    table.finish()
    check_gates(table, phase_index, delay, rr, phases)
    return Samples(phase_index, delay, rr, repeat, sample, speed, r2, status, table.source)


def check_gates(
    table: TextTable, phase_index: IntArray, delay_ms: FloatArray, rr_ms: FloatArray, phases: int
) -> None:
    """Refuse rows whose label contradicts their time: nearly a gate or more from others of their phase.

    Gates follow the R peak by a time or by a share of the beat, so a row is refused that is off in both.

    Args:
        table: The recording, N rows.
        phase_index: Label of each row; shape (N,).
        delay_ms: Its delay; shape (N,).
        rr_ms: Its RR interval; shape (N,).
        phases: Number P of gated phases.

    Raises:
        RecordingError: There is such a row.
    """
    gates = grouped(phase_index)
    share = gates.unwrapped(delay_ms / rr_ms)
    off = np.abs(share - gates.medians(share)[gates.of]) * phases
    off_ms = np.abs(delay_ms - gates.medians(delay_ms)[gates.of]) * phases / np.median(rr_ms)
    wrong = (off >= OTHER_GATE) & (off_ms >= OTHER_GATE)
    table.flag("trigger_delay_ms", wrong, "lies about a gate from other rows of its phase_index", SAME_GATE)
    table.finish()


def read_columns(path: Path, layout: TableLayout, subject: str, wanted: Wanted = GATED) -> TextTable:
    """Return the columns of a recording as text, in this project's form.

    Args:
        path: The recording; its suffix tells the format.
        layout: How the table differs from this project's form.
        subject: Whose rows are wanted of a table of several.
        wanted: The columns, of which the speed may be a modulus.

    Raises:
        RecordingError: It is of no format that is read, or the table is malformed or lacks a column.
    """
    _check_suffix(path)
    if path.suffix.lower() in EXCEL or not layout.is_own:
        return read_foreign(path, layout, subject, wanted)
    required, optional = wanted.of_own_form
    table = READERS[path.suffix.lower()](path, required, optional)
    check_measured(table)
    return table


def _check_suffix(path: Path) -> None:
    suffix = path.suffix.lower()
    if suffix in WORKBOOKS:
        raise RecordingError(Problem(str(path), "is a workbook", SAVE_AS_CSV))
    if suffix not in SUFFIXES:
        raise RecordingError(
            Problem(str(path), f"is none of {', '.join(SUFFIXES)}", "give it in one of these formats")
        )


def check_measured(table: TextTable) -> None:
    """Refuse a table that has not exactly one column of what was measured.

    Raises:
        RecordingError: It has none, or both.
    """
    measured = [name for name in MEASURED if name in table.cells]
    if len(measured) != 1:
        reason = f"has {'both' if measured else 'none'} of the columns {' and '.join(MEASURED)}"
        raise RecordingError(
            Problem(table.source, reason, "give exactly one of them, the one that was measured")
        )


def _phase_index(table: TextTable, phases: int) -> IntArray:
    agree = f"this study expects {phases} phases, numbered 0 to {phases - 1}"
    index = table.cells["phase_index"]
    if (index == str(phases)).any() and not np.isin(index, ("0", "0.0")).any():
        remedy = f"{agree}; number them from 0, or say `first_phase: 1` under `table` in recording.yaml"
    else:
        remedy = (
            f"{agree}; correct the cell, or if {len(set(index))} were recorded, put the recording into a "
            "cohort of its own, with as many phases in all, and say so by --phases or recording.phases"
        )
    return table.integer("phase_index", 0, phases - 1, remedy)


def read_rr_ms(table: TextTable) -> FloatArray:
    """Return the RR intervals in ms."""
    return table.number("rr_ms", 150, 5000, "give the RR interval in ms")


def read_fit_r2(table: TextTable) -> FloatArray:
    """Return R2 of the wave fits; NaN where there was none."""
    return table.number("fit_r2", -1, 1, "R2 is a fraction, empty if there is none", may_be_empty=True)


def read_status(table: TextTable) -> NDArray[np.str_]:
    """Return "ok" or one of ``FAILED_STATUSES`` for each row."""
    return np.asarray(table.choice("status", (STATUS_OK, *FAILED_STATUSES)), dtype=np.str_)


def read_speed(table: TextTable, density_kg_m3: float) -> FloatArray:
    """Return the speeds in m/s, from the modulus where that was measured; NaN where there is none."""
    if SPEED in table.cells:
        (low, high), remedy = SPEED_RANGE_M_S, "give it in m/s, or leave it empty if it failed"
        return table.number(SPEED, low, high, remedy, may_be_empty=True)
    low, high = youngs_modulus_kpa(np.array(SPEED_RANGE_M_S), density_kg_m3)
    remedy = "give it in kPa, or leave it empty if it failed"
    modulus = table.number(MODULUS, float(low), float(high), remedy, may_be_empty=True)
    return shear_wave_speed_m_s(np.maximum(modulus, 0.0), density_kg_m3)
