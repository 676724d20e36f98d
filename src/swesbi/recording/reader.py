"""Reading the attempted samples of one recording, gated or free-running, whatever table they stand in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray, IntArray, rows_of
from swesbi.recording.copies import check_copies
from swesbi.recording.phases import LATEST_BEAT_PHASE
from swesbi.recording.problems import refusal
from swesbi.recording.samples import CONFIGURED, Samples, grouped
from swesbi.recording.speed import PA_PER_KPA, shear_wave_speed_m_s, youngs_modulus_kpa
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import (
    COLUMNS,
    DELAY,
    EVENT,
    FREE_OPTIONAL,
    FREE_REQUIRED,
    MODULUS,
    MODULUS_UNITS,
    OWN_FORM,
    PHASE,
    SPEED,
    SPEED_UNITS,
    STANDARD_ERROR,
    STATUS_OK,
    STATUSES,
    TEXTS,
    TIME,
    TableLayout,
)
from swesbi.recording.tables.table import Table, spelling
from swesbi.recording.tables.translate import in_own_terms, is_free

MEASURED: Final = (SPEED, MODULUS)
REQUIRED: Final = tuple(name for name in COLUMNS if name != SPEED)
NEITHER: Final = "a gated recording has phase_index, a free-running one time_ms; map it under `columns`"
OTHER_GATE: Final = 0.85  # of the distance of two gates; samples binned by phase lie within one
SAME_GATE: Final = "correct the label or the delay; a label stands for one gate, in every repeat"
IN_M_S: Final = "give it in m/s, or leave it empty if it failed; kPa are for the column youngs_modulus_kpa"
SPEED_RANGE_M_S: Final = (0.05, 30.0)
MOST_IN_OTHER_UNITS: Final = 1e4  # kPa, or times the speed
A_TIME: Final = "give the time since the R peak of the push's beat in ms"
ONE_MS: Final = "number the beats in `beat` if these are two pushes, or keep one"
OWN_BEAT: Final = (
    "give the time since the R peak that begins the push's own beat, and number the beats in `beat`"
)


def read_samples(
    path: Path,
    phases: int,
    density_kg_m3: float,
    layout: TableLayout = OWN_FORM,
    subject: str = "",
) -> Samples:
    """Read a gated recording from its file; a free-running one is refused."""
    samples = samples_in(open_table(path, layout), phases, density_kg_m3, layout, subject)
    if not samples.is_gated:
        raise refusal(
            path,
            "is free-running: it has instants (time_ms) and no phases (phase_index)",
            "networks and the experiments of the paper need gated phases; `swesbi infer` answers it without "
            "a network; in a study's own cohort leave it out of `subjects`",
        )
    return samples


def samples_in(
    table: Table,
    phases: int,
    density_kg_m3: float,
    layout: TableLayout = OWN_FORM,
    subject: str = "",
    phases_source: str = CONFIGURED,
) -> Samples:
    """Read a table, from its file or in memory: gated where it has phases, else free-running.

    A recording has either the column ``shear_wave_speed_m_s`` or, in its place, ``youngs_modulus_kpa``, of
    which each value E becomes the speed sqrt(E / (3 rho)). Gated samples are by phase, repeat and sample,
    whatever the order of the rows. An error lists every problem of the table.
    """
    own = in_own_terms(table, layout, subject)
    if EVENT in own.cells:
        raise refusal(
            own.source,
            "says what set off each wave",
            "natural waves are not interpreted: leave them out; a table of pushes goes without this column",
            column=EVENT,
        )
    if PHASE not in own.cells and TIME not in own.cells:
        replace(own, remedy=NEITHER).using((PHASE, TIME))  # which says what it has
    free = is_free(own)
    required, optional = (FREE_REQUIRED, FREE_OPTIONAL) if free else (REQUIRED, ())
    used = own.using(required, (*MEASURED, *optional), TEXTS)
    check_measured(used)
    remedies = {name: f"call it {name}, or map it under `columns` of recording.yaml" for name in optional}
    used.refuse_lookalikes(remedies, lambda lowered, name: spelling(lowered) == spelling(name))
    used.finish()
    samples = _pushes(used, density_kg_m3) if free else samples_of(used, phases, density_kg_m3, phases_source)
    if samples.gate is not None and samples.sample is not None:
        samples = rows_of(samples, np.lexsort((samples.sample, samples.repeat, samples.gate)))
    if not own.copies_allowed:
        check_copies(samples)
    differing = ", ".join(used.differing)
    unused = (f"not used, though its rows differ in it: {differing}",) if differing else ()
    return replace(samples, left_out=(*used.left_out, *unused))


def samples_of(table: Table, phases: int, density_kg_m3: float, phases_source: str = CONFIGURED) -> Samples:
    """Read the columns of a gated recording cell by cell."""
    table.unique([PHASE, "repeat", "sample"])
    gate = _phase_index(table, phases, phases_source)
    delay = table.number(DELAY, 0, 5000, "give the delay from the R peak in ms")
    rr = _rr_ms(table)
    repeat = table.integer("repeat", 0, 10_000, "number the repeats of a phase from 0 or 1")
    sample = table.integer("sample", 0, 1_000_000, "number the samples of a repeat from 0 or 1")
    speed = _speed(table, density_kg_m3)
    r2, status = _fit_r2(table), _status(table)
    table.finish()
    check_gates(table, gate, delay, rr, phases)
    return Samples(
        delay, rr, repeat, speed, status, gate, sample, fit_r2=r2, source=table.source,
        phases_source=phases_source,
    )  # fmt: skip


def check_gates(
    table: Table, phase_index: IntArray, delay_ms: FloatArray, rr_ms: FloatArray, phases: int
) -> None:
    """Refuse rows whose label contradicts their time: nearly a gate or more from others of their phase.

    Gates follow the R peak by a time or by a share of the beat, so a row is refused that is off in both. The
    label, delay and RR interval of each of N rows are (N,).
    """
    gates = grouped(phase_index)
    share = gates.unwrapped(delay_ms / rr_ms)
    off = np.abs(share - gates.medians(share)[gates.of]) * phases
    off_ms = np.abs(delay_ms - gates.medians(delay_ms)[gates.of]) * phases / np.median(rr_ms)
    wrong = (off >= OTHER_GATE) & (off_ms >= OTHER_GATE)
    table.flag(DELAY, wrong, "lies about a gate from other rows of its phase_index", SAME_GATE)
    table.finish()


def check_measured(table: Table) -> None:
    """Refuse a table that has not exactly one column of what was measured."""
    measured = [name for name in MEASURED if name in table.cells]
    if len(measured) != 1:
        reason = f"has {'both' if measured else 'none'} of the columns {' and '.join(MEASURED)}"
        raise refusal(table.source, reason, "give exactly one of them, the one that was measured")


def _pushes(table: Table, density_kg_m3: float) -> Samples:
    """Read the columns of a free-running recording cell by cell."""
    has = table.cells
    # pushes of beats that differ in length are of different beats, whether or not these are numbered
    known = [name for name in ("repeat", "beat", TIME) if name in has]
    if "beat" in has:
        table.unique(known)
    else:
        table.unique([*known[:-1], "rr_ms", TIME], ONE_MS)
    time, rr = table.number(TIME, 0, 5000, A_TIME), _rr_ms(table)
    late = time >= LATEST_BEAT_PHASE * rr
    table.flag(TIME, late, "lies after the end of its beat (time_ms / rr_ms)", OWN_BEAT)
    beat = table.integer("beat", 0, 1_000_000, "number the beats from 0 or 1") if "beat" in has else None
    repeat = np.zeros(len(time), dtype=np.int64)
    if "repeat" in has:
        repeat = table.integer("repeat", 0, 1_000_000, "number the trains from 0 or 1")
    speed = _speed(table, density_kg_m3)
    se = _errors(table, speed, density_kg_m3) if STANDARD_ERROR in has else None
    status = _status(table) if "status" in has else np.full(len(time), STATUS_OK)
    r2 = _fit_r2(table) if "fit_r2" in has else None
    table.finish()
    places = tuple(f"{table.unit} {row}" for row in table.rows)
    unit_of_time = table.units.get(TIME, "")
    return Samples(
        time, rr, repeat, speed, status, beat=beat, se_m_s=se, fit_r2=r2, unit_of_time=unit_of_time,
        source=table.source, places=places,
    )  # fmt: skip


def _phase_index(table: Table, phases: int, phases_source: str) -> IntArray:
    agree = f"{phases_source} is {phases}, so phases are numbered 0 to {phases - 1}"
    index = table.cells[PHASE]
    if (index == str(phases)).any() and not np.isin(index, ("0", "0.0")).any():
        remedy = f"{agree}; number them from 0, or say `first_phase: 1` under `table` in recording.yaml"
    else:
        remedy = (
            f"{agree}; correct the cell, or if {len(set(index))} were recorded, put the recording into a "
            "cohort of its own, with as many phases in all, and say so by --phases or recording.phases"
        )
    return table.integer(PHASE, 0, phases - 1, remedy)


def _rr_ms(table: Table) -> FloatArray:
    return table.number("rr_ms", 150, 5000, "give the RR interval in ms")


def _fit_r2(table: Table) -> FloatArray:
    return table.number("fit_r2", -1, 1, "R2 is a fraction, empty if there is none", may_be_empty=True)


def _status(table: Table) -> NDArray[np.str_]:
    return np.asarray(table.choice("status", STATUSES), dtype=np.str_)


def _speed(table: Table, density_kg_m3: float) -> FloatArray:
    """Return the speeds in m/s, from the modulus where that was measured; NaN where there is none."""
    if SPEED in table.cells:
        low, high = SPEED_RANGE_M_S
        return table.number(SPEED, low, high, IN_M_S, may_be_empty=True)
    low, high = youngs_modulus_kpa(np.array(SPEED_RANGE_M_S), density_kg_m3)
    remedy = "give it in kPa, or leave it empty if it failed"
    modulus = table.number(MODULUS, float(low), float(high), remedy, may_be_empty=True)
    return shear_wave_speed_m_s(np.maximum(modulus, 0.0), density_kg_m3)


def _errors(table: Table, speed_m_s: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return the standard errors in m/s: more than nothing and, of a speed that is to be used, below it.

    Of what was measured in kPa they are, to first order, dc = dE / (6 rho c), since E = 3 rho c^2.
    """
    remedy = "give the standard error of the speed in m/s"
    unit = table.units.get(STANDARD_ERROR)
    highest = SPEED_RANGE_M_S[1] if unit in (None, *SPEED_UNITS) else MOST_IN_OTHER_UNITS
    error = table.number(STANDARD_ERROR, 0.0, highest, remedy, may_be_empty=True)
    if unit in MODULUS_UNITS:
        error = PA_PER_KPA * error / (6.0 * density_kg_m3 * speed_m_s)
    elif unit == "%":
        error = error * speed_m_s
    table.flag(STANDARD_ERROR, error == 0.0, "is no standard error", f"{remedy}, or leave it empty")
    table.flag(STANDARD_ERROR, error >= speed_m_s, "is not smaller than the speed", f"{remedy}; check units")
    return error
