"""The same right-hand side under SciPy's LSODA, beat after beat to the periodic state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import tanh

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from swesbi.context import Context
from swesbi.heart.equations import Drive, Options, Parameters, State, Theta, atrial_rise, right_hand_side
from swesbi.heart.model import build_model
from swesbi.heart.periodic import state_scale
from swesbi.heart.settings import ForwardModelSettings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """Active stiffness (kPa) on the samples of the last beat, and the beats it took."""

    active_stiffness_kpa: Array
    beats: int


def compiled_rates(o: Options) -> Callable[..., Array]:
    """Return x' = f(t, x) as one compiled call, with the activation's closed form."""

    @numba.njit(error_model="numpy")  # type: ignore[untyped-decorator]
    def rates(
        t: float,
        x: Array,
        theta: Theta,
        p: Parameters,
        period: float,
        onset: float,
        duration: float,
        ramp: float,
    ) -> Array:
        s = 0.5 * (tanh((t - onset) / ramp) - tanh((t - onset - duration) / ramp))
        state = State(x[0], x[1], x[2], x[3], x[4], 0.0, 0.0, 0.0)
        drive = Drive(s, atrial_rise(t, period, p, o), 0.0, 0.0, 0.0)
        rate, _ = right_hand_side(state, 1.0, drive, theta, p, o)
        return np.array(
            [
                rate.displacement,
                rate.active_stiffness,
                rate.active_stress,
                rate.arterial_pressure,
                rate.pulmonary_pressure,
            ]
        )

    function: Callable[..., Array] = rates
    return function


def run_to_periodic(
    theta: Array, context: Context, settings: ForwardModelSettings, rates: Callable[..., Array], rtol: float
) -> Run:
    """Integrate one theta (kPa, 1/s, 1/s) until the state repeats itself to the settings' tolerance."""
    model = build_model(context, settings)
    stretch_of_time = np.sqrt(context.period_s / settings.activation_reference_period_s)
    window = (
        settings.activation_onset_s,
        settings.activation_duration_s * stretch_of_time,
        0.5 * settings.activation_ramp_s,
    )
    arguments = (Theta(1e3 * theta[0], theta[1], theta[2]), model.parameters, context.period_s, *window)
    scale = state_scale(model)[:5]
    times = np.arange(model.samples + 1) / model.samples * context.period_s
    x = model.start[:5]
    beats = 0
    for _ in range(settings.maximum_beats):
        beats += 1
        solution = solve_ivp(
            rates,
            (0.0, context.period_s),
            x,
            method="LSODA",
            t_eval=times,
            args=arguments,
            rtol=rtol,
            atol=rtol * scale,
        )
        change = np.max(np.abs(solution.y[:, -1] - x) / scale)
        x = solution.y[:, -1]
        if change <= settings.periodicity_tolerance:
            break
    return Run(1e-3 * solution.y[1, :-1], beats)
