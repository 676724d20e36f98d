"""The activation over a beat of simulations that have an onset, a duration and a ramp of their own.

The formula of :func:`swesbi.heart.model.activation`, compiled: as tanh(2 x) = 2 / (1 + exp(-4 x)) - 1, s(t)
is a sum of logistic steps, of which only the part that is neither 0 nor 1 needs an exponential.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import ceil
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.compiled import equation, kernel, source_key
from swesbi.heart.equations import exponential

# 1 / (1 + exp(-x)) is 0 or 1 to rounding beyond this.
REACH: Final = 37.0


@equation
def logistic(x: float) -> float:
    """Return 1 / (1 + exp(-x)), |x| <= ``REACH``, to 1e-13."""
    return 1.0 / (1.0 + exponential(-x))


@equation
def add_step(curve: FloatArray, spacing_s: float, time_s: float, rate: float, height: float) -> None:
    """Add height / (1 + exp(-rate (t - time_s))) to a curve (m,) at times t = 0, spacing_s, ..."""
    last = curve.size
    begin = min(max(ceil((time_s - REACH / rate) / spacing_s), 0), last)
    end = min(max(ceil((time_s + REACH / rate) / spacing_s), begin), last)
    # Loops over views from zero on, which the compiler turns into SIMD code.
    ramp, after = curve[begin:end], curve[end:]
    for k in range(ramp.size):
        ramp[k] += height * logistic(rate * (spacing_s * (begin + k) - time_s))
    for k in range(after.size):
        after[k] += height


@lru_cache(maxsize=1)
def _activation_kernel() -> Callable[[FloatArray, float, FloatArray, FloatArray, FloatArray], None]:
    """Return the compiled loop over simulations."""
    key = source_key()

    @kernel
    def write_activations(
        curves: FloatArray,
        period_s: float,
        onset_s: FloatArray,
        duration_s: FloatArray,
        ramp_s: FloatArray,
    ) -> None:
        """Write the activations of the beat before, this one and the next to ``curves`` (n, points)."""
        spacing_s = period_s / (curves.shape[1] - 1)
        for i in range(curves.shape[0] if key >= 0 else 0):  # the key is part of what the cache compares
            rate = 4.0 / ramp_s[i]
            curves[i] = 0.0
            for shift_s in (-period_s, 0.0, period_s):
                start_s = onset_s[i] + shift_s
                add_step(curves[i], spacing_s, start_s, rate, 1.0)
                add_step(curves[i], spacing_s, start_s + duration_s[i], rate, -1.0)

    return write_activations


def activations(
    points: int, period_s: float, onset_s: FloatArray, duration_s: FloatArray, ramp_s: FloatArray
) -> FloatArray:
    """Return s(t) in [0, 1] of n simulations at uniform times from one R peak to the next; shape (n, points).

    s = 1/2 [tanh(2 (t - t_on) / w) - tanh(2 (t - t_on - D_T) / w)], repeated with the period, to 1e-13.
    Both R peaks are among the times; onset t_on, duration D_T at this period, and ramp w are (n,).
    """
    curves = np.empty((onset_s.size, points))
    _activation_kernel()(curves, period_s, onset_s, duration_s, ramp_s)
    return curves
