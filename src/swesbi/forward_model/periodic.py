"""The periodic beat of many simulations: beat after beat until the state at the R peak repeats itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.kernel import LANES, RECORDS, STATES, beat_kernel
from swesbi.forward_model.model import Model

Array = NDArray[np.float64]
Index = NDArray[np.intp]

# Simulations advanced together; their records stay in the processor's cache. No effect on the result.
CHUNK: Final = 256


class Status(IntEnum):
    """How a simulation ended."""

    PERIODIC = 0
    NOT_PERIODIC = 1
    NON_FINITE = 2
    OUT_OF_RANGE = 3


@dataclass(frozen=True)
class Records:
    """Recorded beats: ``values`` (n, M, RECORDS) in SI units, with ``status`` (n,) and ``beats`` (n,) run."""

    values: Array
    status: NDArray[np.int8]
    beats: NDArray[np.int64]


def advance(x: Array, theta: Array, model: Model) -> tuple[Array, Array]:
    """Return the states (n, STATES) one beat after ``x`` and the beat's records (n, M, RECORDS)."""
    n = x.shape[0]
    blocks = -(-n // LANES)
    padded = np.concatenate([x, np.repeat(x[-1:], blocks * LANES - n, axis=0)])
    own = np.concatenate([theta, np.repeat(theta[-1:], blocks * LANES - n, axis=0)])
    lanes_x = _to_lanes(padded, blocks)
    record = np.empty((blocks, model.samples + 1, RECORDS * LANES))
    run = beat_kernel(model.options)
    run(lanes_x, _to_lanes(own, blocks), model.parameters, model.drives, model.step_s, model.stride, record)
    after = lanes_x.reshape(blocks, STATES, LANES).transpose(0, 2, 1).reshape(-1, STATES)[:n]
    by_lane = record[:, :-1].reshape(blocks, model.samples, RECORDS, LANES).transpose(0, 3, 1, 2)
    return after, by_lane.reshape(blocks * LANES, model.samples, RECORDS)[:n]


def _to_lanes(values: Array, blocks: int) -> Array:
    width = values.shape[1]
    return np.ascontiguousarray(values.reshape(blocks, LANES, width).transpose(0, 2, 1)).reshape(blocks, -1)


def relative_change(before: Array, after: Array, peak_stiffness: Array, model: Model) -> Array:
    """Return the largest relative change (n,) of displacement, stiffness, stress and pressures in a beat."""
    p = model.parameters
    scale = np.empty_like(after)
    scale[:, 0] = p.radius
    scale[:, 1] = np.maximum(peak_stiffness, 1.0)
    scale[:, 2] = p.sigma_0
    scale[:, 3] = scale[:, 7] = np.abs(after[:, 3]) + 1.0
    scale[:, 4] = np.abs(after[:, 4]) + 1.0
    scale[:, 5] = scale[:, 6] = p.radius**3 / (model.step_s * model.samples * model.stride)
    change: Array = np.max(np.abs(after - before) / scale, axis=1)
    return change


def run_to_periodic(theta: Array, model: Model, tolerance: float, maximum_beats: int) -> Records:
    """Return the first beat of each simulation that ends where it began.

    Args:
        theta: (n, 3) k_0 (Pa), k_ATP (1/s), k_SR (1/s).
        model: The subject's heart and circulation.
        tolerance: Largest relative change over a beat of a state that counts as periodic.
        maximum_beats: Beats after which a simulation counts as not periodic.
    """
    n = theta.shape[0]
    values = np.full((n, model.samples, RECORDS), np.nan)
    status = np.full(n, Status.NOT_PERIODIC, dtype=np.int8)
    beats = np.zeros(n, dtype=np.int64)
    for first in range(0, n, CHUNK):
        own = slice(first, min(first + CHUNK, n))
        _run_chunk(theta[own], model, tolerance, maximum_beats, Records(values[own], status[own], beats[own]))
    return Records(values, status, beats)


def _run_chunk(theta: Array, model: Model, tolerance: float, maximum_beats: int, out: Records) -> None:
    active: Index = np.arange(theta.shape[0])
    x = np.repeat(model.start[None, :], theta.shape[0], axis=0)
    for beat in range(1, maximum_beats + 1):
        after, record = advance(x, theta[active], model)
        change = relative_change(x, after, record[:, :, 1].max(axis=1), model)
        finite = np.isfinite(change)
        done = finite & (change <= tolerance)
        out.beats[active] = beat
        out.status[active[~finite]] = Status.NON_FINITE
        out.status[active[done]] = Status.PERIODIC
        out.values[active[done]] = record[done]
        going = finite & ~done
        active, x = active[going], after[going]
        if active.size == 0:
            return
