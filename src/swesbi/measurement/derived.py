"""Quantities of the stiffness curve that an answer gives besides the parameters.

Other laboratories measure the same duration, peak and decay without any model. Levels are shares of
the way from the late-diastolic mean to the peak.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.heart.simulate import Beats
from swesbi.measurement.landmarks import find_peak, first_crossing_after, last_crossing_before
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import (
    ACTIVE_SHARE,
    CURVE,
    DERIVED_NAMES,
    HALF_ACTIVE,
    ISOMETRIC,
    PEAK_ACTIVE,
    PHI_NAMES,
    REPORTED_NAMES,
)

LATE_DIASTOLE: Final = (0.80, 0.97)
"""Fractions of the cycle whose mean stiffness is the base of the curve: after filling, before activation.

Part of what the quantities mean, so no setting.
"""


def curve_quantities(
    cycle_phase: FloatArray, total_kpa: FloatArray, period_s: float
) -> dict[str, FloatArray]:
    """Return the quantities of ``CURVE`` of n curves (n, M), by name; NaN where a curve has NaN.

    The phases are uniform fractions of the cycle from the R peak.
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


def half_active_ms(cycle_phase: FloatArray, active_kpa: FloatArray, period_s: float) -> FloatArray:
    """Return the time after R at which n active stiffnesses (n, M) have halved since their peak; (n,).

    NaN where a curve has NaN.
    """
    works = np.isfinite(active_kpa).all(axis=1)
    curves, found = active_kpa[works], np.full(len(active_kpa), np.nan)
    peak = find_peak(cycle_phase, curves)
    found[works] = 1e3 * period_s * first_crossing_after(cycle_phase, curves, peak, 0.5 * peak.height)
    return found


def active_share(passive_kpa: FloatArray, active_kpa: FloatArray) -> FloatArray:
    """Return the share of n active stiffnesses (n, M) in the total where this is largest; (n,)."""
    total = passive_kpa + active_kpa
    at = np.nan_to_num(total).argmax(axis=1), np.arange(len(total))
    return np.asarray(active_kpa[at[::-1]] / total[at[::-1]])


def derived(model: SpeedModel, phi: FloatArray, beats: Beats) -> dict[str, FloatArray]:
    """Return the quantities of ``DERIVED`` of n draws, by name, each of shape (n,); NaN where a beat failed.

    The stiffness is the heart's own, without the scale of the speeds.
    """
    passive, shown = model.parts(phi, beats)
    period_s = model.recording.context.period_s
    found = curve_quantities(beats.cycle_phase, passive + shown, period_s) | {
        PEAK_ACTIVE.name: shown.max(axis=1),
        HALF_ACTIVE.name: half_active_ms(beats.cycle_phase, shown, period_s),
        ACTIVE_SHARE.name: active_share(passive, shown),
        ISOMETRIC: isometric_stiffness_kpa(phi, model.activation_duration_s(phi)),
    }
    return {name: found[name] for name in DERIVED_NAMES}


def reported(model: SpeedModel, phi: FloatArray, beats: Beats) -> dict[str, FloatArray]:
    """Return all that an answer reports of n draws, by name in the order of ``REPORTED``; (n,) each.

    Arguments as of :func:`derived`; NaN where a beat failed, but for the parameters themselves.
    """
    known = derived(model, phi, beats) | dict(zip(PHI_NAMES, phi.T, strict=False))
    return {name: known[name] for name in REPORTED_NAMES}
