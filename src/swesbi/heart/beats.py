"""What is read from simulated beats: systolic time intervals, and the pressure at the root of the aorta."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
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
    curves = (beats.aortic_flow_ml_s, beats.mitral_flow_ml_s, beats.active_stiffness_kpa)
    durations = [_durations(*each) for each in zip(*curves, strict=True)]
    contraction, ejection, relaxation = period_s / beats.cycle_phase.size * np.array(durations, dtype=float).T
    return SystolicIntervals(contraction, ejection, relaxation)


def _durations(aortic: FloatArray, mitral: FloatArray, active: FloatArray) -> tuple[float, float, float]:
    """Return the three durations in samples; NaN where a valve never opens."""
    if not (aortic > 0.0).any() or not (mitral > 0.0).any():
        return np.nan, np.nan, np.nan
    if (aortic > 0.0).all():
        return 0.0, float(aortic.size), 0.0
    opening, ejection = ejecting(aortic > 0.0)
    filling = np.roll(mitral > 0.0, -opening)  # seen from the opening of the aortic valve
    relaxation = int(np.argmax(filling[ejection:]))
    closed, rising = int(np.argmax(filling[::-1])), _rising(active, opening)
    return min(closed, rising), ejection, relaxation


def _rising(active: FloatArray, opening: int) -> int:
    """Return for how many samples the active stiffness (M,) has risen when the aortic valve opens."""
    before = np.roll(active, -opening)[::-1]
    return int(np.argmax(np.diff(before) >= 0.0)) + 1


def ejecting(opened: BoolArray) -> tuple[int, int]:
    """Return when a valve opens that was closed for longest, and how long it is not, in samples."""
    closings = np.flatnonzero(~opened & np.roll(opened, 1))
    openings = np.flatnonzero(opened & ~np.roll(opened, 1))
    following = openings[np.searchsorted(openings, closings) % openings.size]
    closed = (following - closings) % opened.size
    longest = int(np.argmax(closed))
    return int(following[longest]), int(opened.size - closed[longest])


def aortic_pressure_mmhg(beats: Beats, settings: ForwardModelSettings) -> FloatArray:
    """Return the pressure behind the aortic valve along each beat, P_s + R_p Q_ao; shape (n, M).

    The recorded arterial pressure P_s is that of the capacitance behind the proximal resistance, tens of
    mmHg below in systole. A proximal capacitance is left out here: it smooths by R_p C_p, a millisecond.
    """
    resistance_mmhg_s_ml = settings.proximal_resistance_pa_s_m3 / PA_PER_MMHG / ML_PER_M3
    pressure: FloatArray = beats.arterial_pressure_mmhg + resistance_mmhg_s_ml * beats.aortic_flow_ml_s
    return pressure
