"""The simulator: theta and context in, one periodic beat out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context, check_ranges
from swesbi.forward_model.beats import (
    ACTIVE_RECORDS,
    ActiveBeats,
    Beats,
    active_beats_of,
    beats_of,
    empty_beats,
    place,
)
from swesbi.forward_model.model import Model, build_model
from swesbi.forward_model.periodic import ALL_RECORDS, Records, Status, run_to_periodic
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.parameters import THETA_NAMES, THETA_RANGES

Array = NDArray[np.float64]

# How many times more steps a simulation gets that fails at the shipped step.
REFINEMENT: Final = 4

# Simulations advanced together; their records stay in the processor's cache. No effect on the result.
CHUNK: Final = 128


def simulate(theta: Array, context: Context, settings: ForwardModelSettings) -> Beats:
    """Simulate beats until they repeat themselves and return the last one.

    A simulation's result depends on its own theta alone, not on the others it is run with.

    Args:
        theta: (n, 3) in the order of ``THETA_NAMES``: k_0 (kPa), k_ATP (1/s), k_SR (1/s).
        context: The subject; HR, IVSd and LVEDV set period and geometry (paper, Eq. 2).
        settings: Options, parameters and numerics.

    Raises:
        ValueError: theta or the context is not finite or outside the declared ranges.
    """
    theta = _checked(theta, context)
    model = _model(context, settings)
    beats = empty_beats(len(theta), model)
    for rows, records in _chunks(theta, context, settings, ALL_RECORDS):
        place(beats_of(records, model), rows, beats)
    return beats


def simulate_active(theta: Array, context: Context, settings: ForwardModelSettings) -> ActiveBeats:
    """Simulate beats as :func:`simulate` does and return the active stiffness alone, which is faster.

    Args:
        theta: (n, 3) in the order of ``THETA_NAMES``.
        context: The subject.
        settings: Options, parameters and numerics.

    Raises:
        ValueError: theta or the context is not finite or outside the declared ranges.
    """
    theta = _checked(theta, context)
    model = _model(context, settings)
    stiffness, status = np.empty((len(theta), model.samples)), np.empty(len(theta), np.int8)
    beats = ActiveBeats(np.arange(model.samples) / model.samples, stiffness, status)
    for rows, records in _chunks(theta, context, settings, ACTIVE_RECORDS):
        part = active_beats_of(records, model)
        stiffness[rows], status[rows] = part.active_stiffness_kpa, part.status
    return beats


def _chunks(
    theta: Array, context: Context, settings: ForwardModelSettings, kept: Sequence[int]
) -> Iterator[tuple[slice, Records]]:
    """Yield the rows of each chunk with their records."""
    si = theta * np.array([1e3, 1.0, 1.0])
    model = _model(context, settings)
    for first in range(0, si.shape[0], CHUNK):
        rows = slice(first, first + CHUNK)
        yield rows, _converged(si[rows], model, context, settings, kept)


@lru_cache(maxsize=64)
def _model(context: Context, settings: ForwardModelSettings, refinement: int = 1) -> Model:
    return build_model(context, settings, refinement)


def _converged(
    theta: Array, model: Model, context: Context, settings: ForwardModelSettings, kept: Sequence[int]
) -> Records:
    """Return the records at the shipped step; what fails there, where the wall is stiff, at a finer one."""
    limits = (settings.periodicity_tolerance, settings.maximum_beats, settings.extrapolation_memory)
    records = run_to_periodic(theta, model, *limits, kept)
    failed = np.flatnonzero(records.status != Status.PERIODIC)
    if failed.size:
        refined = run_to_periodic(theta[failed], _model(context, settings, REFINEMENT), *limits, kept)
        records.values[:, failed] = refined.values
        records.status[failed] = refined.status
        records.beats[failed] += refined.beats
    return records


def _checked(theta: Array, context: Context) -> Array:
    theta = _checked_theta(theta)
    check_ranges(context)
    return theta


def _checked_theta(theta: Array) -> Array:
    theta = np.asarray(theta, dtype=np.float64)
    if theta.ndim != 2 or theta.shape[1] != len(THETA_NAMES) or theta.shape[0] == 0:
        raise ValueError(f"theta has shape {theta.shape}; expected (n, 3) with n >= 1, columns {THETA_NAMES}")
    for column, (name, (low, high)) in enumerate(zip(THETA_NAMES, THETA_RANGES, strict=True)):
        wrong = np.flatnonzero(~((theta[:, column] >= low) & (theta[:, column] <= high)))
        if wrong.size:
            value = theta[wrong[0], column]
            raise ValueError(
                f"theta row {wrong[0]}: {name} = {value:g} is outside [{low:g}, {high:g}]; check its unit"
            )
    return theta
