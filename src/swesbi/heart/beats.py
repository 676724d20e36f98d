"""What is read from simulated beats: systolic time intervals, and the pressure at the root of the aorta."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import ML_PER_M3, PA_PER_MMHG, Beats


@dataclass(frozen=True)
class SystolicIntervals:
    """Durations (n,) in seconds, to the resolution of the beats' samples; NaN where a valve never opens."""

    isovolumic_contraction_s: FloatArray
    ejection_s: FloatArray
    isovolumic_relaxation_s: FloatArray


def systolic_intervals(beats: Beats, period_s: float) -> SystolicIntervals:
    """Measure isovolumic contraction, ejection and isovolumic relaxation of each beat.

    Ejection is from the first to the last aortic flow, with moments within in which the valve closes, as it
    can where the wall has inertia. Isovolumic relaxation reaches from it to the mitral flow. Isovolumic
    contraction begins with the later of the end of the mitral flow and the first bonds, as the first heart
    sound does: atria that have contracted may close the valve long before.
    """
    aortic, mitral = beats.aortic_flow_ml_s > 0.0, beats.mitral_flow_ml_s > 0.0
    samples = beats.cycle_phase.size
    opening, ejection = ejecting(aortic)
    since = np.arange(samples)
    order = (opening[:, None] + since) % samples  # seen from the opening of the aortic valve
    filling = np.take_along_axis(mitral, order, axis=1)
    after = filling & (since >= ejection[:, None])
    relaxation = np.where(after.any(axis=1), after.argmax(axis=1) - ejection, 0)
    before = np.take_along_axis(beats.active_stiffness_kpa, order, axis=1)[:, ::-1]
    rising = (np.diff(before) >= 0.0).argmax(axis=1) + 1  # samples for which it had risen
    contraction = np.minimum(filling[:, ::-1].argmax(axis=1), rising)
    durations = np.stack([contraction, ejection, relaxation]).astype(np.float64)
    durations[:, aortic.all(axis=1)] = np.array([[0.0], [samples], [0.0]])
    durations[:, ~aortic.any(axis=1) | ~mitral.any(axis=1)] = np.nan
    return SystolicIntervals(*(period_s / samples * durations))


def ejecting(opened: BoolArray) -> tuple[IntArray, IntArray]:
    """Return when valves (n, M) open that were closed for longest, and how long they are not, in samples."""
    samples = opened.shape[1]
    twice = np.tile(opened, 2)
    last = np.maximum.accumulate(np.where(twice, np.arange(2 * samples), -1), axis=1)
    closed = (np.arange(2 * samples) - last)[:, samples:]
    longest = closed.argmax(axis=1)
    return (longest + 1) % samples, samples - np.take_along_axis(closed, longest[:, None], axis=1)[:, 0]


def aortic_pressure_mmhg(beats: Beats, settings: ForwardModelSettings) -> FloatArray:
    """Return the pressure behind the aortic valve along each beat, P_s + R_p Q_ao; shape (n, M).

    The recorded arterial pressure P_s is that of the capacitance behind the proximal resistance, tens of
    mmHg below in systole. A proximal capacitance is left out here: it smooths by R_p C_p, a millisecond.
    """
    resistance_mmhg_s_ml = settings.proximal_resistance_pa_s_m3 / PA_PER_MMHG / ML_PER_M3
    pressure: FloatArray = beats.arterial_pressure_mmhg + resistance_mmhg_s_ml * beats.aortic_flow_ml_s
    return pressure
