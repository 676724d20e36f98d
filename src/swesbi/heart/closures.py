"""The instants at which the valves of simulated beats close, between the samples of the beat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.arrays import FloatArray, IntArray
from swesbi.heart.intervals import ejecting
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import ML_PER_M3, PA_PER_MMHG, Beats

NEVER: Final = -1


@dataclass(frozen=True)
class Closures:
    """Phases (n,) in [0, 1) at which flow through a valve ends; NaN where it never opens, or never closes."""

    mitral: FloatArray
    aortic: FloatArray


def valve_closures(beats: Beats, settings: ForwardModelSettings) -> Closures:
    """Return when mitral flow ends before ejection, and when ejection ends.

    The last sample with flow and the next enclose the closure, and what opens the valve is taken as linear
    between them, so that the instant moves continuously with the beat. Of a resistive valve that is the
    pressure across it, of one with inertance its flow.

    Args:
        beats: Simulated beats.
        settings: Those of the simulations; resistances of valves are in no physiology of one simulation.
    """
    mitral, aortic = _last_samples(beats)
    if settings.valves == "resistive":
        across_mitral, across_aortic = _across_mitral(beats, mitral, settings), _across_aortic(beats, aortic)
    else:
        across_mitral = _run_on(beats.mitral_flow_ml_s, mitral)
        across_aortic = _run_on(beats.aortic_flow_ml_s, aortic)
    return Closures(_between(beats, mitral, *across_mitral), _between(beats, aortic, *across_aortic))


def _last_samples(beats: Beats) -> tuple[IntArray, IntArray]:
    """Return the last sample of each beat with mitral and with aortic flow, (n,) each, or ``NEVER``."""
    flows = zip(beats.mitral_flow_ml_s, beats.aortic_flow_ml_s, strict=True)
    mitral, aortic = np.array([_last_of(*flow) for flow in flows], dtype=np.int64).reshape(-1, 2).T
    return mitral, aortic


def _last_of(mitral: FloatArray, aortic: FloatArray) -> tuple[int, int]:
    filling, opened = mitral > 0.0, aortic > 0.0
    if not opened.any() or opened.all() or not filling.any() or filling.all():
        return NEVER, NEVER
    opening, duration = ejecting(opened)
    before = int(np.argmax(np.roll(filling, -opening)[::-1]))  # samples between filling and ejection
    return (opening - 1 - before) % filling.size, (opening + duration - 1) % opened.size


def _across_mitral(
    beats: Beats, last: IntArray, settings: ForwardModelSettings
) -> tuple[FloatArray, FloatArray]:
    """Return atrial less ventricular pressure (mmHg) at the last sample with flow, and at the next.

    The atrial pressure is not recorded. Behind an open valve it is P_v + R Q; it is slow beside P_v, and runs
    on in a straight line for one step.
    """
    resistance = settings.mitral_resistance_pa_s_m3 / PA_PER_MMHG / ML_PER_M3
    ventricular, flow = beats.ventricular_pressure_mmhg, beats.mitral_flow_ml_s
    now, before = (_at(ventricular, last, k) + resistance * _at(flow, last, k) for k in (0, -1))
    return resistance * _at(flow, last, 0), 2.0 * now - before - _at(ventricular, last, 1)


def _across_aortic(beats: Beats, last: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return ventricular less arterial pressure (mmHg) likewise; with flow it is that across R_ao and R_p."""
    across = beats.ventricular_pressure_mmhg - beats.arterial_pressure_mmhg
    return _at(across, last, 0), _at(across, last, 1)


def _run_on(flow: FloatArray, last: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return a flow at its last sample, and what it would be at the next if it went on in a straight line."""
    now = _at(flow, last, 0)
    return now, 2.0 * now - _at(flow, last, -1)


def _at(curves: FloatArray, sample: IntArray, step: int) -> FloatArray:
    """Return curves (n, M) some steps behind a sample of each, through the seam of the cycle; shape (n,)."""
    return np.asarray(curves[np.arange(len(curves)), (sample + step) % curves.shape[1]])


def _between(beats: Beats, last: IntArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the phase at which a line from ``before`` at the last sample to ``after`` at the next is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(after < before, np.clip(before / (before - after), 0.0, 1.0), 1.0)
    phase = (beats.cycle_phase[last] + share / beats.cycle_phase.size) % 1.0
    return np.where((last == NEVER) | ~np.isfinite(before + after), np.nan, phase)
