"""The periodic beat of many simulations: beat after beat until the state at the R peak repeats itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.arrays import BoolArray, FloatArray, IntArray
from swesbi.heart.kernel import LANES, RECORDS, STATES, beat_kernel
from swesbi.heart.model import Model, total_volume

Index = NDArray[np.intp]
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


def advance(x: FloatArray, theta: FloatArray, model: Model) -> tuple[FloatArray, FloatArray]:
    """Return the states (n, STATES) one beat after ``x`` and the beat's records (RECORDS, n, M)."""
    buffer = record_buffer(x.shape[0], model)
    after = _advance(x, theta, model, buffer)
    rows = np.arange(x.shape[0])
    return after, np.stack([_recorded(buffer, record, rows, model) for record in ALL_RECORDS])


def _advance(x: FloatArray, theta: FloatArray, model: Model, buffer: FloatArray) -> FloatArray:
    """Return the states a beat later; the last block is filled up with copies of the last simulation."""
    n = x.shape[0]
    blocks = -(-n // LANES)
    rows = np.minimum(np.arange(blocks * LANES), n - 1)
    state = lane_blocks(x[rows], blocks)
    run = beat_kernel(model.options)
    rates = lane_blocks(theta[rows], blocks)
    run(state, rates, model.parameters, model.drives, model.step_s, model.stride, buffer)
    return state.reshape(blocks, STATES, LANES).transpose(0, 2, 1).reshape(-1, STATES)[:n]


def _recorded(buffer: FloatArray, record: int, rows: Index, model: Model) -> FloatArray:
    """Return one record (rows, M) of these simulations."""
    by_lane = buffer.reshape(buffer.shape[0], model.samples + 1, RECORDS, LANES)
    curves: FloatArray = by_lane[rows // LANES, :-1, record, rows % LANES]
    return curves


def lane_blocks(values: FloatArray, blocks: int) -> FloatArray:
    """Return rows (blocks * LANES, width) as the loop takes them: (blocks, width * LANES), lane by lane."""
    width = values.shape[1]
    return np.ascontiguousarray(values.reshape(blocks, LANES, width).transpose(0, 2, 1)).reshape(blocks, -1)


def state_scale(model: Model) -> FloatArray:
    """Return what a relative change of each state variable refers to (8,).

    Stretch 1 and the arterial pressure, stress and stiffness of the heart at work; a pulmonary pressure
    of the same stressed volume as the cavity's; flows that fill the cavity within a beat.
    """
    p = model.parameters
    volume = 4.0 / 3.0 * np.pi * p.radius**3
    flow = volume / model.period_s
    pressure = model.start[3]
    return np.array([p.radius, p.sigma_0, p.sigma_0, pressure, volume / p.c_pulmonary, flow, flow, pressure])


def with_total_volume(x: FloatArray, total: float, model: Model) -> FloatArray:
    """Return states (n, 8) whose pulmonary pressure gives the closed loop its stressed volume again.

    The loop neither gains nor loses blood: V + C_s P_s + C_pul P_pul (+ C_p P_p) is invariant.
    """
    if not model.options.closed_loop:
        return x
    out = x.copy()
    out[:, 4] += (total - total_volume(x, model)) / model.parameters.c_pulmonary
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
) -> Records:
    """Return the first beat of each simulation that ends where it began.

    Args:
        theta: (n, 3) k_0 (Pa), k_ATP (1/s), k_SR (1/s).
        model: The subject's heart and circulation.
        tolerance: Largest relative change over a beat of a state that counts as periodic.
        maximum_beats: Beats after which a simulation counts as not periodic.
        memory: Earlier beats from which the periodic state is extrapolated; 0 runs beat after beat.
        kept: Which of the kernel's records to return.
    """
    n = theta.shape[0]
    values = np.full((len(kept), n, model.samples), np.nan)
    out = Records(values, np.full(n, Status.NOT_PERIODIC, dtype=np.int8), np.zeros(n, dtype=np.int64))
    rows = np.arange(n)
    if memory > 0:
        _run(rows, theta, model, tolerance, min(maximum_beats, EXTRAPOLATED_BEATS), memory, kept, out)
        rows = np.flatnonzero(out.status != Status.PERIODIC)
    if rows.size:
        _run(rows, theta, model, tolerance, maximum_beats, 0, kept, out)
    return out


def _run(
    rows: Index,
    theta: FloatArray,
    model: Model,
    tolerance: float,
    maximum_beats: int,
    memory: int,
    kept: Sequence[int],
    out: Records,
) -> None:
    """Run these rows of ``theta`` from the start and write what they come to into ``out``."""
    out.status[rows] = Status.NOT_PERIODIC
    x = np.repeat(model.start[None, :], rows.size, axis=0)
    total = float(total_volume(model.start[None], model)[0])
    scale = state_scale(model)
    extrapolation = Extrapolation(scale, memory)
    buffer = record_buffer(rows.size, model)
    for _ in range(maximum_beats):
        after = _advance(x, theta[rows], model, buffer)
        out.beats[rows] += 1
        change = np.max(np.abs(after - x) / scale, axis=1)
        finite = np.isfinite(change)
        done = finite & (change <= tolerance)
        out.status[rows[~finite]] = Status.NON_FINITE
        out.status[rows[done]] = Status.PERIODIC
        for curves, record in zip(out.values, kept, strict=True):
            curves[rows[done]] = _recorded(buffer, record, np.flatnonzero(done), model)
        going = finite & ~done
        if not going.any():
            return
        # Finished simulations leave, and the others close up: blocks stay full of work.
        rows = rows[going]
        x, after = x[going], after[going]
        if memory > 0:
            extrapolation.keep(going)
            # The volumes need not sum to the blood in the loop any more, which no later beat would correct.
            x = with_total_volume(extrapolation.next(x, after), total, model)
        else:
            x = after
