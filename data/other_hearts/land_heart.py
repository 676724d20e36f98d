"""The sphere of this project with the bridges of Land et al. (2017) in its wall: one periodic beat.

Geometry, passive wall, valves and circulation are the equations of :mod:`swesbi.heart.equations`; the active
law and the integration in time are not. The tension per unstretched area enters where the model's does, along
the stretch of the mid-wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.integrate import solve_ivp

from data.other_hearts.land import (
    RELAXED,
    Bridges,
    CalciumTransient,
    LandParameters,
    bond_stiffness_kpa,
    bridge_rates,
    tension_kpa,
)
from studies.validation.hearts.beat import PHASES, Beat
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.equations import Drive, Flow, State, chamber, circulation_rates
from swesbi.heart.model import Model, build_model, cavity_volume
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import ML_PER_M3, PA_PER_MMHG

PA_PER_KPA: Final = 1e3
ARTERIAL_PA, PULMONARY_PA = 1e4, 1e3
"""Units of the two pressures in the integrated state, so that all of it is of order one."""
RELATIVE, ABSOLUTE = 1e-6, 1e-8  # tolerances of the integration
LONGEST_STEP: Final = 0.01  # of a beat, so that no transient of calcium is stepped over
PERIODIC: Final = 1e-4  # largest change of the state over a beat
MAXIMUM_BEATS: Final = 80
NO_DRIVE: Final = Drive(0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class LandHeart:
    """One heart: its bridges, what drives them, and the settings of wall, valves and circulation.

    ``wave_share`` is the share of the bonds' stiffness along the fibre that a shear wave meets. The settings'
    own active law and activation are not used.
    """

    law: LandParameters
    calcium: CalciumTransient
    wave_share: float
    settings: ForwardModelSettings


def land_beat(heart: LandHeart, context: Context) -> Beat:
    """Run a heart beat after beat until one ends as it began; its stiffness is as the wave meets it.

    Where the integration fails, or no beat is periodic, that is a RuntimeError.
    """
    _check(heart.settings)
    model = build_model(context, heart.settings)
    times = context.period_s * np.arange(PHASES + 1) / PHASES
    state = _start(model)
    for _ in range(MAXIMUM_BEATS):
        states = _run(state, times, heart, model)
        if np.max(np.abs(states[:, -1] - state)) < PERIODIC:
            return _beat(states[:, :-1], heart, model)
        state = states[:, -1]
    raise RuntimeError(f"{context.subject}: no periodic beat in {MAXIMUM_BEATS}")


def _check(settings: ForwardModelSettings) -> None:
    closed = settings.circulation == "closed" and settings.valves == "resistive"
    if not closed or settings.wall_inertia or settings.atrial_kick_pa:
        raise ValueError(
            "a heart with the bridges of Land et al. needs forward_model with a closed circulation, "
            f"resistive valves, no wall inertia and no atrial contraction, not {settings.circulation!r}, "
            f"{settings.valves!r}, {settings.wall_inertia}, {settings.atrial_kick_pa:g} Pa"
        )


def _start(model: Model) -> FloatArray:
    displacement, pressures = model.start[0], (model.start[3] / ARTERIAL_PA, model.start[4] / PULMONARY_PA)
    return np.array([1.0 + displacement / model.parameters.radius, *pressures, *RELAXED])


def _run(state: FloatArray, times: FloatArray, heart: LandHeart, model: Model) -> FloatArray:
    """Return the states (9, M + 1) at the times of one beat."""

    def rate(time_s: float, x: FloatArray) -> list[float]:
        return _rate(time_s, x, heart, model, float(times[-1]))

    solved = solve_ivp(
        rate,
        (times[0], times[-1]),
        state,
        method="LSODA",
        t_eval=times,
        rtol=RELATIVE,
        atol=ABSOLUTE,
        max_step=LONGEST_STEP * times[-1],
    )
    if not solved.success or not np.isfinite(solved.y).all():
        raise RuntimeError(f"the integration of the beat failed: {solved.message}")
    return np.asarray(solved.y)


def _rate(time_s: float, x: FloatArray, heart: LandHeart, model: Model, period_s: float) -> list[float]:
    stretch, bridges = float(x[0]), Bridges(*map(float, x[3:]))
    velocity, flow, arterial, pulmonary = _mechanics(x, bridges, heart, model)
    stretch_rate = velocity / model.parameters.radius
    calcium = heart.calcium.at(time_s, period_s)
    attached = bridge_rates(bridges, calcium, stretch, stretch_rate, heart.law)
    return [stretch_rate, arterial / ARTERIAL_PA, pulmonary / PULMONARY_PA, *attached]


def _mechanics(
    x: FloatArray, bridges: Bridges, heart: LandHeart, model: Model
) -> tuple[float, Flow, float, float]:
    """Return y' (m/s), cavity pressure (Pa) with the flows, and the rates of the two pressures (Pa/s)."""
    p, o = model.parameters, model.options
    tension_pa = PA_PER_KPA * tension_kpa(bridges, float(x[0]), heart.law)
    arterial_pa, pulmonary_pa = ARTERIAL_PA * float(x[1]), PULMONARY_PA * float(x[2])
    state = State(
        (float(x[0]) - 1.0) * p.radius, 0.0, tension_pa, arterial_pa, pulmonary_pa, 0.0, 0.0, arterial_pa
    )
    velocity, flow, _, _ = chamber(state, 0.0, NO_DRIVE, p, o)
    arterial, pulmonary, _ = circulation_rates(state, flow, NO_DRIVE, p, o)
    return velocity, flow, arterial, pulmonary


def _beat(states: FloatArray, heart: LandHeart, model: Model) -> Beat:
    bridges = [Bridges(*map(float, column)) for column in states[3:].T]
    pressure = [_mechanics(x, b, heart, model)[1].pressure for x, b in zip(states.T, bridges, strict=True)]
    stretch = states[0]
    stiffness = [bond_stiffness_kpa(b, float(s), heart.law) for b, s in zip(bridges, stretch, strict=True)]
    return Beat(
        active_kpa=heart.wave_share * np.array(stiffness),
        stretch=stretch,
        volume_ml=ML_PER_M3 * cavity_volume(stretch, model),
        ventricular_mmhg=np.array(pressure) / PA_PER_MMHG,
        arterial_mmhg=ARTERIAL_PA * states[1] / PA_PER_MMHG,
    )
