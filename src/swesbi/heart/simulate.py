"""The simulator: theta and context in, one periodic beat out, in the units of the laboratory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.context import Context, check_ranges
from swesbi.heart.kernel import ACTIVE_STIFFNESS, DISPLACEMENT, VENTRICULAR_PRESSURE
from swesbi.heart.model import Model, build_model, cavity_volume, own_of
from swesbi.heart.periodic import ALL_RECORDS, Records, Status, run_to_periodic
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.parameters import THETA_NAMES, THETA_RANGES, THETA_SI

PA_PER_MMHG: Final = 133.322387415
ML_PER_M3: Final = 1e6
# Outside these a periodic beat means nothing: the wall stretched or compressed beyond twofold, no cavity
# left, a ventricular pressure that no heart survives.
STRETCH_RANGE: Final = (0.5, 2.0)
PRESSURE_RANGE_PA: Final = (-1.0e4, 1.0e5)
# Records behind ``ActiveBeats``, in the order that ``active_beats_of`` takes.
ACTIVE_RECORDS: Final = (DISPLACEMENT, ACTIVE_STIFFNESS, VENTRICULAR_PRESSURE)
_NOT_CURVES: Final = ("cycle_phase", "status", "beats")
# How many times more steps a simulation gets that fails at the shipped step.
REFINEMENT: Final = 4
# Simulations run together, which keeps blocks full while ever fewer go on. No effect on the result.
CHUNK: Final = 512


@dataclass(frozen=True)
class Beats:
    """The last, periodic beat of n simulations on M uniform phases from the R peak.

    Rows whose ``status`` is not ``Status.PERIODIC`` hold NaN.
    """

    cycle_phase: FloatArray
    active_stiffness_kpa: FloatArray
    stretch: FloatArray
    volume_ml: FloatArray
    ventricular_pressure_mmhg: FloatArray
    arterial_pressure_mmhg: FloatArray
    aortic_flow_ml_s: FloatArray
    mitral_flow_ml_s: FloatArray
    status: NDArray[np.int8]
    beats: IntArray

    def rows(self, chosen: IntArray) -> Beats:
        """Return the simulations of these numbers, some of them perhaps several times."""
        own = {name: values[chosen] for name, values in vars(self).items() if name != "cycle_phase"}
        return replace(self, **own)

    @property
    def end_diastolic_volume_ml(self) -> FloatArray:
        """Largest volume of the beat (n,)."""
        volume: FloatArray = self.volume_ml.max(axis=1)
        return volume

    @property
    def end_systolic_volume_ml(self) -> FloatArray:
        """Smallest volume of the beat (n,)."""
        volume: FloatArray = self.volume_ml.min(axis=1)
        return volume

    @property
    def ejection_fraction(self) -> FloatArray:
        """(EDV - ESV) / EDV (n,)."""
        return 1.0 - self.end_systolic_volume_ml / self.end_diastolic_volume_ml


@dataclass(frozen=True)
class ActiveBeats:
    """What a likelihood of stiffness needs of the last beat of n simulations; as in :class:`Beats`."""

    cycle_phase: FloatArray
    active_stiffness_kpa: FloatArray
    stretch: FloatArray
    status: NDArray[np.int8]


def beats_of(records: Records, model: Model) -> Beats:
    """Convert recorded beats to laboratory units; what left the range of the equations gets its status."""
    y, stiffness, arterial, pressure, mitral, aortic, _ = records.values
    stretch = 1.0 + y / model.parameters.radius
    volume = cavity_volume(stretch, model)
    inside = (
        _within(stretch, STRETCH_RANGE) & _within(pressure, PRESSURE_RANGE_PA) & (volume.min(axis=1) > 0.0)
    )
    outside = (records.status == Status.PERIODIC) & ~inside
    beats = Beats(
        cycle_phase=model.cycle_phase,
        active_stiffness_kpa=1e-3 * stiffness,
        stretch=stretch,
        volume_ml=ML_PER_M3 * volume,
        ventricular_pressure_mmhg=pressure / PA_PER_MMHG,
        arterial_pressure_mmhg=arterial / PA_PER_MMHG,
        aortic_flow_ml_s=ML_PER_M3 * aortic,
        mitral_flow_ml_s=ML_PER_M3 * mitral,
        status=np.where(outside, np.int8(Status.OUT_OF_RANGE), records.status).astype(np.int8),
        beats=records.beats,
    )
    if outside.any():
        for curves in _curves(beats).values():
            curves[outside] = np.nan
    return beats


def active_beats_of(records: Records, model: Model) -> ActiveBeats:
    """Return stiffness and stretch of beats of which ``ACTIVE_RECORDS`` were kept, with the status of all.

    The volume grows with the stretch, so the smallest is that of the smallest stretch.
    """
    y, stiffness, pressure = records.values
    stretch = 1.0 + y / model.parameters.radius
    volume = cavity_volume(stretch.min(axis=1, keepdims=True), model)
    inside = _within(stretch, STRETCH_RANGE) & _within(pressure, PRESSURE_RANGE_PA) & (volume[:, 0] > 0.0)
    outside = (records.status == Status.PERIODIC) & ~inside
    active = 1e-3 * stiffness
    active[outside] = stretch[outside] = np.nan
    status = np.where(outside, np.int8(Status.OUT_OF_RANGE), records.status).astype(np.int8)
    return ActiveBeats(model.cycle_phase, active, stretch, status)


def empty_beats(n: int, model: Model) -> Beats:
    """Return room for ``n`` simulations."""
    names = (field.name for field in fields(Beats))
    curves = {name: np.empty((n, model.samples)) for name in names if name not in _NOT_CURVES}
    return Beats(model.cycle_phase, **curves, status=np.empty(n, np.int8), beats=np.empty(n, np.int64))


def place(chunk: Beats, rows: slice, whole: Beats) -> None:
    """Write the simulations of ``chunk`` to these rows of ``whole``."""
    for name, curves in _curves(whole).items():
        curves[rows] = getattr(chunk, name)
    whole.status[rows] = chunk.status
    whole.beats[rows] = chunk.beats


def _curves(beats: Beats) -> dict[str, FloatArray]:
    return {f.name: getattr(beats, f.name) for f in fields(beats) if f.name not in _NOT_CURVES}


def _within(curves: FloatArray, limits: tuple[float, float]) -> BoolArray:
    inside: BoolArray = (curves.min(axis=1) > limits[0]) & (curves.max(axis=1) < limits[1])
    return inside


def simulate(
    theta: FloatArray,
    context: Context,
    settings: ForwardModelSettings,
    physiology: Physiology | None = None,
) -> Beats:
    """Simulate beats until they repeat themselves and return the last one.

    theta (n, 3) has the order of ``THETA_NAMES``, in kPa and 1/s. HR, IVSd and LVEDV of the context set
    period and geometry (paper, Eq. 2). A simulation's result depends on its own theta and physiology alone,
    not on the others it is run with. What is not finite or outside the declared ranges is a ValueError.
    """
    theta = _checked_theta(theta)
    check_ranges(context)
    physiology = physiology.checked(len(theta)) if physiology else None
    model = _model(context, settings)
    beats = empty_beats(len(theta), model)
    for rows, records in _chunks(theta, context, settings, physiology, ALL_RECORDS):
        place(beats_of(records, model), rows, beats)
    return beats


def simulate_active(
    theta: FloatArray,
    context: Context,
    settings: ForwardModelSettings,
    physiology: Physiology | None = None,
) -> ActiveBeats:
    """Simulate beats as :func:`simulate` does and return what a stiffness needs alone, which is faster."""
    theta = _checked_theta(theta)
    check_ranges(context)
    physiology = physiology.checked(len(theta)) if physiology else None
    model = _model(context, settings)
    stiffness, stretch = np.empty((2, len(theta), model.samples))
    beats = ActiveBeats(model.cycle_phase, stiffness, stretch, np.empty(len(theta), np.int8))
    for rows, records in _chunks(theta, context, settings, physiology, ACTIVE_RECORDS):
        chunk = active_beats_of(records, model)
        stiffness[rows], stretch[rows] = chunk.active_stiffness_kpa, chunk.stretch
        beats.status[rows] = chunk.status
    return beats


def _chunks(
    theta: FloatArray,
    context: Context,
    settings: ForwardModelSettings,
    physiology: Physiology | None,
    kept: Sequence[int],
) -> Iterator[tuple[slice, Records]]:
    """Yield the rows of each chunk with their records."""
    si = theta * np.array(THETA_SI)
    for first in range(0, si.shape[0], CHUNK):
        rows = slice(first, first + CHUNK)
        own = physiology.rows(rows) if physiology else None
        yield rows, _converged(si[rows], context, settings, own, kept)


@lru_cache(maxsize=64)
def _model(context: Context, settings: ForwardModelSettings, refinement: int = 1) -> Model:
    return build_model(context, settings, refinement)


def _converged(
    theta: FloatArray,
    context: Context,
    settings: ForwardModelSettings,
    physiology: Physiology | None,
    kept: Sequence[int],
) -> Records:
    """Return the records at the shipped step; what fails there, where the wall is stiff, at a finer one."""
    records = _periodic(theta, context, settings, physiology, kept, 1)
    failed = np.flatnonzero(records.status != Status.PERIODIC)
    if failed.size:
        own = physiology.rows(failed) if physiology else None
        refined = _periodic(theta[failed], context, settings, own, kept, REFINEMENT)
        records.values[:, failed] = refined.values
        records.status[failed] = refined.status
        records.beats[failed] += refined.beats
    return records


def _periodic(
    theta: FloatArray,
    context: Context,
    settings: ForwardModelSettings,
    physiology: Physiology | None,
    kept: Sequence[int],
    refinement: int,
) -> Records:
    """Return the records with ``refinement`` times the shipped number of steps."""
    model = _model(context, settings, refinement)
    own = own_of(physiology, model, settings) if physiology else None
    limits = (settings.periodicity_tolerance, settings.maximum_beats, settings.extrapolation_memory)
    return run_to_periodic(theta, model, *limits, kept, own)


def _checked_theta(theta: FloatArray) -> FloatArray:
    theta = np.asarray(theta, dtype=np.float64)
    if theta.ndim != 2 or theta.shape[1] != len(THETA_NAMES) or theta.shape[0] == 0:
        wanted = f"(n, {len(THETA_NAMES)}) with n >= 1, columns {THETA_NAMES}"
        raise ValueError(f"theta has shape {theta.shape}; expected {wanted}")
    for column, (name, (low, high)) in enumerate(zip(THETA_NAMES, THETA_RANGES, strict=True)):
        wrong = np.flatnonzero(~((theta[:, column] >= low) & (theta[:, column] <= high)))
        if wrong.size:
            value = theta[wrong[0], column]
            raise ValueError(
                f"theta row {wrong[0]}: {name} = {value:g} is outside [{low:g}, {high:g}]; check its unit"
            )
    return theta
