"""The activation of the fibre over a beat, and the active stiffness that it attains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.parameters import K_0, K_ATP

Array = NDArray[np.float64]


def activation_duration_s(period_s: float, settings: ForwardModelSettings) -> float:
    """Return D_T = D sqrt(T / T_ref), the duration of the activation at a cardiac period (Bazett 1920)."""
    ratio = period_s / settings.activation_reference_period_s
    return float(settings.activation_duration_s * np.sqrt(ratio))


def activation(time_s: Array, period_s: float, settings: ForwardModelSettings) -> Array:
    """Return the activation s(t) in [0, 1] at times after the R peak, repeated with the period.

    s = 1/2 [tanh(2 (t - t_on) / w) - tanh(2 (t - t_on - D_T) / w)].
    """
    duration_s = activation_duration_s(period_s, settings)
    total = np.zeros_like(time_s)
    for shift_s in (-period_s, 0.0, period_s):
        t = time_s - shift_s - settings.activation_onset_s
        ramp_s = 0.5 * settings.activation_ramp_s
        total += 0.5 * (np.tanh(t / ramp_s) - np.tanh((t - duration_s) / ramp_s))
    return total


def attained_share(k_atp_per_s: Array, duration_s: float) -> Array:
    """Return 1 - exp(-k_ATP D_T): the share of k_0 that the stiffness attains, at constant length.

    The solution of the bond kinetics k_c' = k_ATP (k_0 - k_c) from rest (Chapelle et al. 2012).
    """
    return np.asarray(-np.expm1(-k_atp_per_s * duration_s))


def attained_stiffness_kpa(parameters: Array, duration_s: float) -> Array:
    """Return k_0 (1 - exp(-k_ATP D_T)) in kPa, shape (n,), of theta (n, 3) or phi (n, 4)."""
    return np.asarray(parameters[:, K_0] * attained_share(parameters[:, K_ATP], duration_s))
