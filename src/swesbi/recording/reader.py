"""Reading the raw samples of one gated recording, whatever table they stand in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray, IntArray, rows_of
from swesbi.recording.copies import check_copies
from swesbi.recording.groups import grouped
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.samples import CONFIGURED, Samples
from swesbi.recording.speed import shear_wave_speed_m_s, youngs_modulus_kpa
from swesbi.recording.tables.columns import COLUMNS, EVENT, MODULUS, PHASE, SPEED, STATUSES, TEXTS, TIME
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import OWN_FORM, TableLayout
from swesbi.recording.tables.table import Table, spelling
from swesbi.recording.tables.translate import in_own_terms, is_free

MEASURED: Final = (SPEED, MODULUS)
REQUIRED: Final = tuple(name for name in COLUMNS if name != SPEED)
NOT_GATED: Final = "is free-running: it has instants (time_ms) and no phases (phase_index)"
ASK_FREE: Final = (
    "networks and the experiments of the paper need gated phases; `swesbi infer` answers it without a "
    "network; in a study's own cohort leave it out of `subjects`"
)
NEITHER: Final = "a gated recording has phase_index, a free-running one time_ms; map it under `columns`"
EVENT_HERE: Final = "says what set off each wave"
NO_EVENT: Final = (
    "natural waves are not interpreted: leave them out; a table of pushes goes without this column"
)
OTHER_GATE: Final = 0.85  # of the distance of two gates; samples binned by phase lie within one
SAME_GATE: Final = "correct the label or the delay; a label stands for one gate, in every repeat"
IN_M_S: Final = "give it in m/s, or leave it empty if it failed; kPa are for the column youngs_modulus_kpa"
SPEED_RANGE_M_S: Final = (0.05, 30.0)


def read_samples(
    path: Path,
    phases: int,
    density_kg_m3: float,
    layout: TableLayout = OWN_FORM,
    subject: str = "",
) -> Samples:
    """Read one row (CSV, workbook) or element (.mat) per attempted push sample.

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
    return gated_samples(in_own_terms(open_table(path, layout), layout, subject), phases, density_kg_m3)


def gated_samples(
    table: Table, phases: int, density_kg_m3: float, phases_said_in: str = CONFIGURED
) -> Samples:
    """Read a table, in this project's columns, as a gated recording; as :func:`read_samples`."""
    if is_free(table):
        raise RecordingError(Problem(table.source, NOT_GATED, ASK_FREE))
    check_no_events(table)
    if PHASE not in table.cells:
        replace(table, remedy=NEITHER).using((PHASE, TIME))  # which says what it has
    used = table.using(REQUIRED, MEASURED, TEXTS)
    check_measured(used)
    samples = samples_of(used, phases, density_kg_m3, phases_said_in)
    order = np.lexsort((samples.sample, samples.repeat, samples.phase_index))
    ordered = replace(rows_of(samples, order), unused=used.differing, phases_said_in=phases_said_in)
    if not table.copies_allowed:
        _check_copies(ordered)
    return ordered


def _check_copies(samples: Samples) -> None:
    repeats = grouped(samples.phase_index, samples.repeat)
    phase, repeat = samples.phase_index[repeats.first], samples.repeat[repeats.first]
    names = [f"repeat {r} of phase_index {p}" for p, r in zip(phase, repeat, strict=True)]
    check_copies(samples.source, samples.speed_m_s, repeats.of, phase, names)


def refuse_lookalikes(table: Table, optional: Sequence[str]) -> None:
    """Refuse a column that is not used and that looks like an optional one that is not there.

    Raises:
        RecordingError: There is one.
    """
    remedies = {name: f"call it {name}, or map it under `columns` of recording.yaml" for name in optional}
    table.refuse_lookalikes(remedies, lambda lowered, name: spelling(lowered) == spelling(name))
    table.finish()


def check_no_events(table: Table) -> None:
    """Refuse natural waves.

    Raises:
        RecordingError: The table says what set off each wave.
    """
    if EVENT in table.cells:
        raise RecordingError(Problem(table.source, EVENT_HERE, NO_EVENT, column=EVENT))


def samples_of(table: Table, phases: int, density_kg_m3: float, phases_said_in: str = CONFIGURED) -> Samples:
    """Read the columns of a gated recording cell by cell.

    Args:
        table: The columns in use.
        phases: Number of gated phases.
        density_kg_m3: Density rho behind a Young's modulus.
        phases_said_in: Where the number of phases is said.

    Raises:
        RecordingError: A value is impossible, a sample is given twice, or a row lies at another gate than
            its phase.
    """
    table.unique(["phase_index", "repeat", "sample"])
    phase_index = _phase_index(table, phases, phases_said_in)
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
    table: Table, phase_index: IntArray, delay_ms: FloatArray, rr_ms: FloatArray, phases: int
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


def check_measured(table: Table) -> None:
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


def _phase_index(table: Table, phases: int, phases_said_in: str) -> IntArray:
    agree = f"{phases_said_in} is {phases}, so phases are numbered 0 to {phases - 1}"
    index = table.cells[PHASE]
    if (index == str(phases)).any() and not np.isin(index, ("0", "0.0")).any():
        remedy = f"{agree}; number them from 0, or say `first_phase: 1` under `table` in recording.yaml"
    else:
        remedy = (
            f"{agree}; correct the cell, or if {len(set(index))} were recorded, put the recording into a "
            "cohort of its own, with as many phases in all, and say so by --phases or recording.phases"
        )
    return table.integer(PHASE, 0, phases - 1, remedy)


def read_rr_ms(table: Table) -> FloatArray:
    """Return the RR intervals in ms."""
    return table.number("rr_ms", 150, 5000, "give the RR interval in ms")


def read_fit_r2(table: Table) -> FloatArray:
    """Return R2 of the wave fits; NaN where there was none."""
    return table.number("fit_r2", -1, 1, "R2 is a fraction, empty if there is none", may_be_empty=True)


def read_status(table: Table) -> NDArray[np.str_]:
    """Return "ok" or one of ``FAILED_STATUSES`` for each row."""
    return np.asarray(table.choice("status", STATUSES), dtype=np.str_)


def read_speed(table: Table, density_kg_m3: float) -> FloatArray:
    """Return the speeds in m/s, from the modulus where that was measured; NaN where there is none."""
    if SPEED in table.cells:
        (low, high), remedy = SPEED_RANGE_M_S, IN_M_S
        return table.number(SPEED, low, high, remedy, may_be_empty=True)
    low, high = youngs_modulus_kpa(np.array(SPEED_RANGE_M_S), density_kg_m3)
    remedy = "give it in kPa, or leave it empty if it failed"
    modulus = table.number(MODULUS, float(low), float(high), remedy, may_be_empty=True)
    return shear_wave_speed_m_s(np.maximum(modulus, 0.0), density_kg_m3)
