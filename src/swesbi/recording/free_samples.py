"""A free-running recording as it was read: pushes at any instants of any beats, and which are accepted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.copies import check_copies
from swesbi.recording.groups import grouped
from swesbi.recording.phases import LATEST_BEAT_PHASE
from swesbi.recording.reader import (
    MEASURED,
    SPEED_RANGE_M_S,
    check_measured,
    check_no_events,
    read_fit_r2,
    read_rr_ms,
    read_speed,
    read_status,
    refuse_lookalikes,
)
from swesbi.recording.samples import ACCEPTED, REASONS
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import PA_PER_KPA
from swesbi.recording.tables.columns import (
    FAILED_STATUSES,
    FREE_OPTIONAL,
    FREE_REQUIRED,
    MODULUS_UNITS,
    SPEED_UNITS,
    STANDARD_ERROR,
    STATUS_OK,
    TEXTS,
    TIME,
)
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import OWN_FORM, TableLayout
from swesbi.recording.tables.table import Table
from swesbi.recording.tables.translate import in_own_terms

MOST_IN_OTHER_UNITS: Final = 1e4  # kPa, or times the speed
A_TIME: Final = "give the time since the R peak of the push's beat in ms"
ONE_MS: Final = "number the beats in `beat` if these are two pushes, or keep one"
OWN_BEAT: Final = (
    "give the time since the R peak that begins the push's own beat, and number the beats in `beat`"
)


@dataclass(frozen=True)
class FreeSamples:
    """Columns of a free-running recording, each of shape (N,), N attempted pushes in any order.

    Attributes:
        time_ms: Time of the push since the R peak of its beat.
        rr_ms: RR interval of that beat.
        beat: Which beat; 0 where the file does not say.
        repeat: Which of several trains; 0 where the file does not say.
        speed_m_s: Shear-wave speed c_s; NaN where the estimate failed.
        se_m_s: Its standard error; NaN where none is given.
        fit_r2: R2 of the wave fit; NaN where there was none.
        status: "ok" or one of ``FAILED_STATUSES``.
        columns: Which optional columns the file has.
        unit_of_time: That is stated of the times as they were given; empty where none is.
        source: Where the samples come from, for messages.
        places: Where each push stands in the file, in words; empty of samples in memory.
        unused: Columns of the file that nobody asks for and in which its rows differ.
    """

    time_ms: FloatArray
    rr_ms: FloatArray
    beat: IntArray
    repeat: IntArray
    speed_m_s: FloatArray
    se_m_s: FloatArray
    fit_r2: FloatArray
    status: NDArray[np.str_]
    columns: tuple[str, ...] = ()
    unit_of_time: str = ""
    source: str = "samples in memory"
    places: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()

    @property
    def phase(self) -> FloatArray:
        """Instant of each push as a fraction of its own beat, time / RR modulo the beat, in [0, 1); (N,)."""
        return np.asarray((self.time_ms / self.rr_ms) % 1.0)

    def beats_rr_ms(self) -> FloatArray:
        """Return the RR interval of each beat: the median over its pushes; beats of a train in order."""
        named, index = np.unique(np.stack([self.repeat, self.beat]), axis=1, return_inverse=True)
        if "beat" not in self.columns:  # nobody can tell the beats apart
            return self.rr_ms
        return np.array([np.median(self.rr_ms[index.ravel() == beat]) for beat in range(named.shape[1])])


def read_free_samples(
    path: Path, density_kg_m3: float, layout: TableLayout = OWN_FORM, subject: str = ""
) -> FreeSamples:
    """Read one row (CSV, workbook) or element (.mat) per attempted push.

    Args:
        path: The recording; its suffix tells the format.
        density_kg_m3: Density rho behind a Young's modulus.
        layout: How the table differs from this project's form, by ``recording.yaml``.
        subject: Whose rows are wanted of a table of several.

    Raises:
        RecordingError: The table is malformed or one of natural waves, a value is impossible, or a push is
            given twice or lies beyond the end of its beat; it lists every problem with file, row, column and
            value.
    """
    return free_samples(in_own_terms(open_table(path, layout), layout, subject), density_kg_m3)


def free_samples(whole: Table, density_kg_m3: float) -> FreeSamples:
    """Read a table, in this project's columns, as a free-running recording; as :func:`read_free_samples`."""
    check_no_events(whole)
    table = whole.using(FREE_REQUIRED, (*MEASURED, *FREE_OPTIONAL), TEXTS)
    check_measured(table)
    refuse_lookalikes(table, FREE_OPTIONAL)
    has = tuple(name for name in FREE_OPTIONAL if name in table.cells)
    # pushes of beats that differ in length are of different beats, whether or not these are numbered
    known = [name for name in ("repeat", "beat", TIME) if name in table.cells]
    table.unique(known if "beat" in has else ["rr_ms", *known], ONE_MS if "beat" not in has else "keep one")
    time = table.number(TIME, 0, 5000, A_TIME)
    rr = read_rr_ms(table)
    late = time >= LATEST_BEAT_PHASE * rr
    table.flag(TIME, late, "lies after the end of its beat (time_ms / rr_ms)", OWN_BEAT)
    beat = _numbered(table, "beat", "number the beats from 0 or 1")
    repeat = _numbered(table, "repeat", "number the trains from 0 or 1")
    speed = read_speed(table, density_kg_m3)
    samples = FreeSamples(
        time,
        rr,
        beat,
        repeat,
        speed,
        _errors(table, speed, density_kg_m3),
        read_fit_r2(table) if "fit_r2" in has else np.full(len(time), np.nan),
        read_status(table) if "status" in has else np.full(len(time), STATUS_OK),
        has,
        table.units.get(TIME, ""),
        table.source,
        tuple(f"{table.unit} {row}" for row in table.rows),
        table.differing,
    )
    table.finish()
    if "beat" in has and not whole.copies_allowed:
        beats = grouped(repeat, beat)
        names = [f"beat {beat[index]}" for index in beats.first]
        check_copies(table.source, speed, beats.of, np.zeros(len(names), dtype=np.int64), names)
    return samples


def _numbered(table: Table, column: str, remedy: str) -> IntArray:
    if column not in table.cells:
        return np.zeros(len(table.rows), dtype=np.int64)
    return table.integer(column, 0, 1_000_000, remedy)


def _errors(table: Table, speed_m_s: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return the standard errors in m/s: more than nothing and, of a speed that is to be used, below it.

    Of what was measured in kPa they are, to first order, dc = dE / (6 rho c), since E = 3 rho c^2.
    """
    if STANDARD_ERROR not in table.cells:
        return np.full(len(table.rows), np.nan)
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


def free_rejection(samples: FreeSamples, settings: RecordingSettings) -> IntArray:
    """Return for each push the index into ``REASONS`` of its rejection, or ``ACCEPTED``; shape (N,).

    As of gated samples, but for what needs others at the same phase or errors: there are no sparse phases,
    and outliers are found afterwards (``free_quality``). A fit is judged where the file has one.
    """
    verdict = np.full(samples.status.shape, ACCEPTED, dtype=np.int64)
    rules: list[tuple[BoolArray, str]] = [(samples.status == name, name) for name in FAILED_STATUSES]
    rules.append((np.isnan(samples.speed_m_s), "empty_speed"))
    if "fit_r2" in samples.columns:
        rules.append((~(samples.fit_r2 >= settings.min_fit_r2), "low_fit_r2"))
    median = float(np.median(samples.beats_rr_ms()))
    rules.append((np.abs(samples.rr_ms / median - 1.0) > settings.max_rr_deviation_fraction, "ectopic_rr"))
    for wrong, reason in rules:
        verdict[wrong & (verdict == ACCEPTED)] = REASONS.index(reason)
    return verdict
