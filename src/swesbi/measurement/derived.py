"""Quantities of the stiffness curve that an answer gives besides the parameters.

Other laboratories measure the same duration, peak and decay without any model. Levels are shares of
the way from the late-diastolic mean to the peak.
"""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.simulate import Beats
from swesbi.measurement.landmarks import find_peak, first_crossing_after, last_crossing_before
from swesbi.measurement.speeds import SpeedRecording
from swesbi.parameters import BONDS, CURVE, DERIVED_NAMES, PHI_NAMES, SHOWN, TOLD_NAMES

LATE_DIASTOLE: Final = (0.80, 0.97)
"""Fractions of the cycle whose mean stiffness is the base of the curve: after filling, before activation.

Part of what the quantities mean, so no setting.
"""


def curve_quantities(
    cycle_phase: FloatArray, total_kpa: FloatArray, period_s: float
) -> dict[str, FloatArray]:
    """Return the quantities of ``CURVE`` of n curves, by name; NaN where a curve has NaN.

    Args:
        cycle_phase: Uniform fractions of the cycle from the R peak; shape (M,).
        total_kpa: Total stiffness; shape (n, M).
        period_s: Length of the cycle.
    """
    works = np.isfinite(total_kpa).all(axis=1)
    curves = total_kpa[works]
    window = (cycle_phase >= LATE_DIASTOLE[0]) & (cycle_phase <= LATE_DIASTOLE[1])
    base, peak = curves[:, window].mean(axis=1), find_peak(cycle_phase, curves)
    rise = peak.height - base
    fall = {
        share: first_crossing_after(cycle_phase, curves, peak, base + share * rise)
        for share in (0.75, 0.5, 0.25)
    }
    up = last_crossing_before(cycle_phase, curves, peak, base + 0.5 * rise)
    found = (
        1e3 * period_s * (fall[0.5] - up),
        peak.height,
        # the rate k of an exponential, of which a third of the height is left after log(3) / k
        np.log(3.0) / (period_s * np.maximum(fall[0.25] - fall[0.75], cycle_phase[1])),
        1e3 * period_s * (fall[0.5] - peak.phase),
        base,
    )
    columns = np.full((len(CURVE), len(total_kpa)), np.nan)
    columns[:, works] = found
    return {quantity.name: column for quantity, column in zip(CURVE, columns, strict=True)}


class StiffnessModel(Protocol):
    """A model of one recording that tells the stiffness of its simulations, as ``SpeedModel`` does."""

    @property
    def recording(self) -> SpeedRecording:
        """The recording."""

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi (n, d) in the subject's context."""

    def parts(self, phi: FloatArray, cycles: Beats) -> tuple[FloatArray, FloatArray]:
        """Return passive and shown active stiffness in kPa of phi (n, d); (n, M) each."""

    def speed_scale(self, phi: FloatArray) -> FloatArray:
        """Return the scale of the speeds of phi (n, d); shape (n,)."""


def derived(model: StiffnessModel, phi: FloatArray, beats: Beats) -> dict[str, FloatArray]:
    """Return the quantities of ``DERIVED`` of n draws, by name, each of shape (n,); NaN where a beat failed.

    The stiffness is the heart's own, without the scale of the speeds.

    Args:
        model: The recording and its model.
        phi: Draws; shape (n, d).
        beats: Their beats.
    """
    passive, shown = model.parts(phi, beats)
    curve = curve_quantities(beats.cycle_phase, passive + shown, model.recording.context.period_s)
    largest = {SHOWN.name: shown.max(axis=1), BONDS.name: beats.active_stiffness_kpa.max(axis=1)}
    return {name: (largest | curve)[name] for name in DERIVED_NAMES}


def told(model: StiffnessModel, phi: FloatArray, beats: Beats) -> dict[str, FloatArray]:
    """Return all that an answer reports of n draws, by name in the order of ``TOLD``; (n,) each.

    Arguments as of :func:`derived`; NaN where a beat failed, but for the parameters themselves.
    """
    known = derived(model, phi, beats) | dict(zip(PHI_NAMES, phi.T, strict=False))
    return {name: known[name] for name in TOLD_NAMES}
