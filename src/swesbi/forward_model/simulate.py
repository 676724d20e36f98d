"""The simulator: theta and context in, one periodic beat out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.forward_model.model import Model, build_model, cavity_volume
from swesbi.forward_model.periodic import Records, Status, run_to_periodic
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.theta import THETA_NAMES

Array = NDArray[np.float64]

PA_PER_MMHG: Final = 133.322387415
ML_PER_M3: Final = 1e6

# Declared ranges of the inputs: an order of magnitude beyond published myocardial parameters (Marchesseau et
# al. 2013; Banus et al. 2021), so that any prior of a study fits inside, yet a wrong unit does not.
THETA_RANGES: Final = ((1.0, 500.0), (0.1, 500.0), (0.1, 300.0))
# From a newborn to the most dilated heart, from sinus bradycardia to the fastest exercise (Lang et al. 2015).
CONTEXT_RANGES: Final = {"hr_bpm": (30.0, 220.0), "lvedv_ml": (10.0, 500.0), "ivsd_cm": (0.2, 3.0)}
# d_0 / R_0: 0.3 in health, 0.7 in the most severe hypertrophy; at 2 the mid-wall sphere has no cavity left.
RELATIVE_THICKNESS_RANGE: Final = (0.04, 1.0)

# How many times more steps a simulation gets that fails at the shipped step.
REFINEMENT: Final = 4

# Outside these a periodic beat means nothing: the wall stretched or compressed beyond twofold, no cavity
# left, a ventricular pressure that no heart survives.
STRETCH_RANGE: Final = (0.5, 2.0)
PRESSURE_RANGE_PA: Final = (-1.0e4, 1.0e5)


@dataclass(frozen=True)
class Beats:
    """The last, periodic beat of n simulations on M uniform phases from the R peak.

    Rows whose ``status`` is not ``Status.PERIODIC`` hold NaN.
    """

    cycle_phase: Array
    active_stiffness_kpa: Array
    stretch: Array
    volume_ml: Array
    ventricular_pressure_mmhg: Array
    arterial_pressure_mmhg: Array
    aortic_flow_ml_s: Array
    mitral_flow_ml_s: Array
    status: NDArray[np.int8]
    beats: NDArray[np.int64]

    @property
    def end_diastolic_volume_ml(self) -> Array:
        """Largest volume of the beat (n,)."""
        volume: Array = self.volume_ml.max(axis=1)
        return volume

    @property
    def end_systolic_volume_ml(self) -> Array:
        """Smallest volume of the beat (n,)."""
        volume: Array = self.volume_ml.min(axis=1)
        return volume

    @property
    def ejection_fraction(self) -> Array:
        """(EDV - ESV) / EDV (n,)."""
        return 1.0 - self.end_systolic_volume_ml / self.end_diastolic_volume_ml


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
    theta = _checked_theta(theta)
    _check_context(context)
    si = theta * np.array([1e3, 1.0, 1.0])
    return _beats(_converged(si, context, settings), build_model(context, settings))


def _converged(theta: Array, context: Context, settings: ForwardModelSettings) -> Records:
    """Return the records at the shipped step; what fails there, where the wall is stiff, at a shorter one."""
    limits = (settings.periodicity_tolerance, settings.maximum_beats, settings.extrapolation_memory)
    records = run_to_periodic(theta, build_model(context, settings), *limits)
    failed = np.flatnonzero(records.status != Status.PERIODIC)
    if failed.size:
        refined = run_to_periodic(theta[failed], build_model(context, settings, REFINEMENT), *limits)
        records.values[failed] = refined.values
        records.status[failed] = refined.status
        records.beats[failed] += refined.beats
    return records


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


def _check_context(context: Context) -> None:
    for name, (low, high) in CONTEXT_RANGES.items():
        value = getattr(context, name)
        if not low <= value <= high:
            raise ValueError(
                f"subject {context.subject}: {name} = {value:g} is outside [{low:g}, {high:g}]; "
                "check its unit"
            )
    relative = context.thickness_m / context.radius_m
    low, high = RELATIVE_THICKNESS_RANGE
    if not low <= relative <= high:
        raise ValueError(
            f"subject {context.subject}: ivsd_cm = {context.ivsd_cm:g} is {relative:.2f} of the radius of a "
            f"sphere of lvedv_ml = {context.lvedv_ml:g}; expected {low:g} to {high:g}; check both units"
        )


def _beats(records: Records, model: Model) -> Beats:
    y, stiffness, arterial, pressure, mitral, aortic, _ = np.moveaxis(records.values, 2, 0)
    stretch = 1.0 + y / model.parameters.radius
    volume = cavity_volume(stretch, model)
    low, high = PRESSURE_RANGE_PA
    inside = (stretch > STRETCH_RANGE[0]) & (stretch < STRETCH_RANGE[1]) & (volume > 0.0)
    inside &= (pressure > low) & (pressure < high)
    outside = (records.status == Status.PERIODIC) & ~inside.all(axis=1)
    hide = np.where(outside, np.nan, 1.0)[:, None]
    return Beats(
        cycle_phase=np.arange(model.samples) / model.samples,
        active_stiffness_kpa=1e-3 * stiffness * hide,
        stretch=stretch * hide,
        volume_ml=ML_PER_M3 * volume * hide,
        ventricular_pressure_mmhg=pressure / PA_PER_MMHG * hide,
        arterial_pressure_mmhg=arterial / PA_PER_MMHG * hide,
        aortic_flow_ml_s=ML_PER_M3 * aortic * hide,
        mitral_flow_ml_s=ML_PER_M3 * mitral * hide,
        status=np.where(outside, np.int8(Status.OUT_OF_RANGE), records.status).astype(np.int8),
        beats=records.beats,
    )
