"""The periodic beat of many simulations: beat after beat until the state at the R peak repeats itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.base.workers import in_threads
from swesbi.heart.kernel import LANES, OWN_WIDTH, RECORDS, STATES, beat_kernel
from swesbi.heart.model import Model, Own, pressure_factor, starts, total_volume
from swesbi.heart.physiology import Physiology

Index = NDArray[np.intp]
# Simulations that a thread advances between two looks at their records, which stay in the processor's cache.
TOGETHER: Final = 64
# A simulation that is not periodic after as many extrapolated beats runs again, beat after beat.
EXTRAPOLATED_BEATS: Final = 15
ALL_RECORDS: Final = tuple(range(RECORDS))
# Positions in ``State`` of stiffness, stress and the two flows.
NEVER_NEGATIVE: Final = [1, 2, 5, 6]


class Status(IntEnum):
    """How a simulation ended."""

    PERIODIC = 0
    NOT_PERIODIC = 1
    NON_FINITE = 2
    OUT_OF_RANGE = 3


@dataclass(frozen=True)
class Records:
    """Recorded beats: ``values`` (RECORDS, n, M) in SI units, with ``status`` (n,) and ``beats`` (n,) run.

    Fewer records than ``RECORDS`` where not all were asked for.
    """

    values: FloatArray
    status: NDArray[np.int8]
    beats: IntArray


def record_buffer(n: int, model: Model) -> FloatArray:
    """Return room for the records of a beat of ``n`` simulations, as the loop writes them."""
    return np.empty((-(-n // LANES), model.samples + 1, RECORDS * LANES))


@dataclass(frozen=True)
class Lanes:
    """What differs between n simulations of a model, as the loop takes it.

    ``values`` (n, 3) holds theta, with physiology by simulation (n, 12) also ``OWN_PARAMETERS``, and then
    ``activation`` (n, 2 * steps + 1) their activation.
    """

    values: FloatArray
    activation: FloatArray
    by_simulation: bool

    def blocks(self, rows: Index) -> FloatArray:
        """Return what these simulations, whole blocks of them, have of their own; with room to work in."""
        blocks = rows.size // LANES
        values = lane_blocks(self.values[rows], blocks)
        if not self.by_simulation:
            return values
        own = np.empty((blocks, OWN_WIDTH * LANES))
        own[:, : values.shape[1]] = values
        return own


def lanes_of(theta: FloatArray, model: Model, own: Own | None) -> Lanes:
    """Return theta (n, 3), joined with what the simulations have in place of the model's."""
    if own is None:
        return Lanes(theta, np.empty((0, 0)), by_simulation=False)
    p, mine = model.parameters, own.physiology
    parameters = (  # in the order of ``OWN_PARAMETERS``
        p.c0 * mine.passive_wall_factor,
        p.c2 * mine.passive_wall_factor,
        mine.sigma_0_pa,
        mine.destruction_alpha,
        mine.distal_resistance_pa_s_m3,
        mine.systemic_capacitance_m3_pa,
        mine.length_dependence,
        mine.atrial_kick_pa,
        mine.atrial_delay_s,
    )
    return Lanes(np.column_stack((theta, *parameters)), own.activation, by_simulation=True)


def advance(
    x: FloatArray, theta: FloatArray, model: Model, own: Own | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return the states (n, STATES) one beat after ``x`` and the beat's records (RECORDS, n, M)."""
    buffer = record_buffer(x.shape[0], model)
    rows = np.arange(x.shape[0])
    after = _advance(x, rows, lanes_of(theta, model, own), model, buffer)
    return after, np.stack([_recorded(buffer, record, rows, model) for record in ALL_RECORDS])


def _advance(x: FloatArray, rows: Index, lanes: Lanes, model: Model, buffer: FloatArray) -> FloatArray:
    """Return the states of these rows a beat later; copies of the last simulation fill up the last block."""
    n = x.shape[0]
    blocks = -(-n // LANES)
    places = np.minimum(np.arange(blocks * LANES), n - 1)
    state = lane_blocks(x[places], blocks)
    lane_rows = rows[places]
    options = model.by_simulation if lanes.by_simulation else model.options
    run = beat_kernel(options, lanes.by_simulation)
    shared = (model.parameters, model.drives, model.step_s, model.stride)
    own = (lanes.activation, lane_rows.reshape(blocks, LANES))
    run(state, lanes.blocks(lane_rows), *shared, buffer, *own)
    return state.reshape(blocks, STATES, LANES).transpose(0, 2, 1).reshape(-1, STATES)[:n]


def _recorded(buffer: FloatArray, record: int, rows: Index, model: Model) -> FloatArray:
    """Return one record (rows, M) of these simulations."""
    by_lane = buffer.reshape(buffer.shape[0], model.samples + 1, RECORDS, LANES)
    curves: FloatArray = by_lane[rows // LANES, :-1, record, rows % LANES]
    return curves


def lane_blocks(values: FloatArray, blocks: int) -> FloatArray:
    """Return rows (blocks * LANES, width) as the loop takes them: (blocks, width * LANES), lane by lane."""
    width = values.shape[1]
    by_lane = values.reshape(blocks, LANES, width).transpose(0, 2, 1)
    return np.ascontiguousarray(by_lane).reshape(blocks, width * LANES)


def state_scale(model: Model, physiology: Physiology | None = None) -> FloatArray:
    """Return what a relative change of each state variable refers to; (8,), with physiology (n, 8).

    Stretch 1 and the arterial pressure, stress and stiffness of the heart at work; a pulmonary pressure
    of the same stressed volume as the cavity's; flows that fill the cavity within a beat.
    """
    p = model.parameters
    volume = 4.0 / 3.0 * np.pi * p.radius**3
    flow = volume / model.period_s
    pressure = model.start[3] * (1.0 if physiology is None else pressure_factor(model, physiology))
    stress = p.sigma_0 if physiology is None else physiology.sigma_0_pa
    scale = (p.radius, stress, stress, pressure, volume / p.c_pulmonary, flow, flow, pressure)
    return np.stack(np.broadcast_arrays(*scale), axis=-1)


def with_total_volume(
    x: FloatArray, total: FloatArray, model: Model, physiology: Physiology | None = None
) -> FloatArray:
    """Return states (n, 8) whose pulmonary pressure gives the closed loop its stressed volume (n,) again.

    The loop neither gains nor loses blood: V + C_s P_s + C_pul P_pul (+ C_p P_p) is invariant.
    """
    if not model.options.closed_loop:
        return x
    out = x.copy()
    out[:, 4] += (total - total_volume(x, model, physiology)) / model.parameters.c_pulmonary
    return out


class Extrapolation:
    """Anderson's extrapolation of the fixed point of a beat, for each simulation on its own.

    Walker and Ni (2011, SIAM J. Numer. Anal. 49:1715): of the last beats x_j -> g_j the combination with the
    smallest residual g - x continues. A beat forgets all but a few slow modes (the two volumes), so a short
    memory suffices.
    """

    def __init__(self, scale: FloatArray, memory: int) -> None:
        self.scale = scale
        self.memory = memory
        self.images: list[FloatArray] = []
        self.residuals: list[FloatArray] = []

    def keep(self, rows: BoolArray) -> None:
        """Forget the simulations that are not in ``rows``."""
        self.scale = self.scale[rows]
        self.images = [image[rows] for image in self.images]
        self.residuals = [residual[rows] for residual in self.residuals]

    def next(self, x: FloatArray, image: FloatArray) -> FloatArray:
        """Return the state from which to run the next beat, given that ``x`` led to ``image``."""
        self.images = [*self.images, image / self.scale][-self.memory - 1 :]
        self.residuals = [*self.residuals, (image - x) / self.scale][-self.memory - 1 :]
        if len(self.images) < 2:
            return image
        # Differences of successive beats span the modes that decay slowly; their combination of the smallest
        # residual (least squares) leads past the beats in between.
        f = np.diff(np.stack(self.residuals, axis=-1), axis=-1)
        g = np.diff(np.stack(self.images, axis=-1), axis=-1)
        gram = np.einsum("nij,nik->njk", f, f)
        # Late beats hardly differ, so the equations are close to singular; the ridge bounds the weights.
        ridge = 1e-8 * np.trace(gram, axis1=1, axis2=2)[:, None, None] + 1e-300
        right = np.einsum("nij,ni->nj", f, self.residuals[-1])
        weights = np.linalg.solve(gram + ridge * np.eye(f.shape[2]), right[..., None])
        extrapolated: FloatArray = (self.images[-1] - (g @ weights)[..., 0]) * self.scale
        # A combination of states need not be a state: stiffness, stress and flows are never negative.
        extrapolated[:, NEVER_NEGATIVE] = np.maximum(extrapolated[:, NEVER_NEGATIVE], 0.0)
        return extrapolated


def run_to_periodic(
    theta: FloatArray,
    model: Model,
    tolerance: float,
    maximum_beats: int,
    memory: int,
    kept: Sequence[int] = ALL_RECORDS,
    own: Own | None = None,
) -> Records:
    """Return the first beat of each simulation that ends where it began, to a relative change of a state.

    theta (n, 3) holds k_0 (Pa), k_ATP (1/s), k_SR (1/s). The periodic state is extrapolated from ``memory``
    earlier beats; 0 runs beat after beat.
    """
    n = theta.shape[0]
    values = np.full((len(kept), n, model.samples), np.nan)
    out = Records(values, np.full(n, Status.NOT_PERIODIC, dtype=np.int8), np.zeros(n, dtype=np.int64))
    rows = np.arange(n)
    if memory > 0:
        _run(rows, theta, model, own, tolerance, min(maximum_beats, EXTRAPOLATED_BEATS), memory, kept, out)
        rows = np.flatnonzero(out.status != Status.PERIODIC)
    if rows.size:
        _run(rows, theta, model, own, tolerance, maximum_beats, 0, kept, out)
    return out


def _run(
    rows: Index,
    theta: FloatArray,
    model: Model,
    own: Own | None,
    tolerance: float,
    maximum_beats: int,
    memory: int,
    kept: Sequence[int],
    out: Records,
) -> None:
    """Run these rows of ``theta`` from the start and write what they come to into ``out``."""
    out.status[rows] = Status.NOT_PERIODIC
    lanes = lanes_of(theta, model, own)
    physiology = own.physiology if own else None
    n = theta.shape[0]
    start, total = starts(n, model, physiology)
    x = start[rows]
    scale = np.broadcast_to(state_scale(model, physiology), (n, STATES))
    extrapolation = Extrapolation(scale[rows], memory)
    _advance(x[:0], rows[:0], lanes, model, record_buffer(0, model))  # compiled here: Ctrl-C ends no thread
    for _ in range(maximum_beats):
        after, going = _beat(x, rows, lanes, scale, tolerance, model, kept, out)
        if not going.any():
            return
        # Finished simulations leave, and the others close up: blocks stay full of work.
        rows = rows[going]
        x, after = x[going], after[going]
        if memory > 0:
            extrapolation.keep(going)
            # The volumes need not sum to the blood in the loop any more, which no later beat would correct.
            mine = physiology.rows(rows) if physiology else None
            x = with_total_volume(extrapolation.next(x, after), total[rows], model, mine)
        else:
            x = after


def _beat(
    x: FloatArray,
    rows: Index,
    lanes: Lanes,
    scale: FloatArray,
    tolerance: float,
    model: Model,
    kept: Sequence[int],
    out: Records,
) -> tuple[FloatArray, BoolArray]:
    """Return the states of these rows a beat after ``x``, and which go on; write the others into ``out``."""
    after, going = np.empty_like(x), np.empty(rows.size, np.bool_)

    def advance_part(part: slice) -> None:
        buffer = record_buffer(rows[part].size, model)
        after[part] = _advance(x[part], rows[part], lanes, model, buffer)
        change = np.max(np.abs(after[part] - x[part]) / scale[rows[part]], axis=1)
        going[part] = _settled(rows[part], change, tolerance, buffer, model, kept, out)

    in_threads(advance_part, [slice(first, first + TOGETHER) for first in range(0, rows.size, TOGETHER)])
    return after, going


def _settled(
    rows: Index,
    change: FloatArray,
    tolerance: float,
    buffer: FloatArray,
    model: Model,
    kept: Sequence[int],
    out: Records,
) -> BoolArray:
    """Write what has become of these rows after a beat into ``out``; return which of them go on."""
    out.beats[rows] += 1
    finite = np.isfinite(change)
    done = finite & (change <= tolerance)
    out.status[rows[~finite]] = Status.NON_FINITE
    out.status[rows[done]] = Status.PERIODIC
    for curves, record in zip(out.values, kept, strict=True):
        curves[rows[done]] = _recorded(buffer, record, np.flatnonzero(done), model)
    return finite & ~done
