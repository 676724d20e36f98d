"""Hearts of PhysioBlocks 2.0.1 by this project's loop, with atria, walls and ramps of wider ranges.

The program takes 10 to 80 s a heart, this loop some ten milliseconds. Equations and reference heart are the
program's (``physioblocks``), its valves' leak and its stiff series spring left out. Three things vary more:
how high atrial contraction is and when it ends, how stiff the wall is, and how long bonds take to form.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.references import PHYSIOBLOCKS_OPTIONS
from data.other_hearts.drawn import Drawn
from data.other_hearts.physioblocks import ATRIAL_PA, REFERENCE, SIZED, VARIED, WALL_PA, size_of
from studies.validation.hearts.beat import PHASES, Beat
from studies.validation.hearts.heart import K_SR
from studies.validation.hearts.ranges import log_uniform
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.equations import Parameters
from swesbi.heart.model import Model, cavity_volume
from swesbi.heart.periodic import Status, run_to_periodic
from swesbi.heart.simulate import ML_PER_M3, PA_PER_MMHG
from swesbi.parameters import K_ATP, THETA_SI
from swesbi.prior import PriorSettings, sample
from swesbi.virtual.generated import Range

LETTER: Final = "p"
KICK_PA: Final[Range] = (0.0, 1000.0)
KICK_END_S: Final[Range] = (-0.04, 0.08)  # after the R peak
WALL: Final[Range] = (1.0 / 3.0, 3.0)
RAMP_S: Final[Range] = (0.005, 0.15)
"""Uniform, the wall's and the ramp's in the logarithm."""
ATRIAL_S: Final = (-0.13, -0.07, -0.05, 0.0)
"""Of the program's atrial contraction: start, begin and end of its height, end, before that end."""
REFERENCE_PERIOD_S: Final = 0.9
IDLE_S, ACTIVE_S = 0.037, 0.38
"""From the R peak until bonds form, and how long they do, at the reference period."""
CREATION_S: Final = (0.054, 0.326)
"""When they do at half the rate, after they begin to."""
SWITCH_S: Final = 0.01
"""How long relaxation takes to end before bonds form, and to begin afterwards."""
ACTIVE_SHARE: Final = 0.2
"""Of a change of the period that the time of forming bonds takes in the program; others take the rest."""
STEP_S: Final = 5e-4
TOLERANCE, BEATS, MEMORY = 2e-4, 150, 1


@dataclass(frozen=True)
class EmulatedHearts:
    """Where the hearts come from: theta is of a prior, the rest about the program's reference heart."""

    prior: PriorSettings

    @property
    def letter(self) -> str:
        """Its letter."""
        return LETTER

    @property
    def settings(self) -> dict[str, Any]:
        """What a heart depends on besides its draws and the population."""
        return {"prior": self.prior.to_plain()}

    def draw(self, context: Context, rng: np.random.Generator) -> Drawn:
        """Draw theta from the prior, and wall, atrium, ramps and circulation."""
        theta = sample(1, self.prior, rng)[0]
        own = {name: value * log_uniform(VARIED, rng) for name, value in REFERENCE.items()}
        own |= {name: own[name] * size_of(context) for name in SIZED}
        own["atrial_kick_pa"] = float(rng.uniform(*KICK_PA))
        own["atrial_end_s"] = float(rng.uniform(*KICK_END_S))
        own["wall_stiffness"] = log_uniform(WALL, rng)
        own["creation_ramp_s"] = log_uniform(RAMP_S, rng)
        return Drawn(theta, own)

    def beat(self, context: Context, drawn: Drawn) -> Beat:
        """Return the periodic beat of a heart; a RuntimeError where it has none."""
        theta, model = drawn.theta * np.array(THETA_SI), model_of(context, drawn)
        records = run_to_periodic(theta[None], model, TOLERANCE, BEATS, MEMORY)
        if records.status[0] != Status.PERIODIC:
            raise RuntimeError(f"no periodic beat in {BEATS}")
        y, stiffness, arterial, pressure = records.values[:4, 0]
        stretch = 1.0 + y / context.radius_m
        volume = ML_PER_M3 * cavity_volume(stretch, model)
        return Beat(1e-3 * stiffness, stretch, volume, pressure / PA_PER_MMHG, arterial / PA_PER_MMHG)

    def refusal(self, beat: Beat) -> str:
        """Refuse none: theta keeps the distribution of the prior, whatever beats it makes."""
        return ""


def model_of(context: Context, drawn: Drawn) -> Model:
    """Return the heart of these draws, ready to run."""
    own, period_s = drawn.own, context.period_s
    stride = int(np.ceil(period_s / PHASES / STEP_S))
    steps = PHASES * stride
    time_s = np.linspace(0.0, period_s, 2 * steps + 1)
    drives = np.zeros((time_s.size, 5))
    drives[:, 0] = activation(time_s, period_s, drawn.theta, own["creation_ramp_s"])
    low = own["atrial_pressure"] * ATRIAL_PA["min"]
    drives[:, 1] = low + own["atrial_kick_pa"] * kick(time_s, period_s, own["atrial_end_s"])
    drives[:, 2] = own["venous_pressure_pa"]
    start = np.array([0.1 * context.radius_m, 1.0, 0.0, 10760.0, 0.0, 0.0, 0.0, 10760.0])
    options = PHYSIOBLOCKS_OPTIONS
    return Model(options, _parameters(context, drawn), drives, period_s / steps, stride, start, options)


def _parameters(context: Context, drawn: Drawn) -> Parameters:
    own: Mapping[str, float] = drawn.own
    c_0, c_1, c_2, c_3 = WALL_PA
    wall, distal = own["wall_stiffness"], own["distal_resistance_pa_s_m3"]
    return Parameters(
        radius=context.radius_m,
        thickness=context.thickness_m,
        density=1000.0,
        c0=wall * c_0,
        c1=c_1,
        c2=wall * c_2,
        c3=c_3,
        wall_viscosity=70.0,
        fibre_viscosity=70.0,
        sigma_0=own["contractility_pa"],
        alpha=own["destruction_per_contraction_rate_s"] * float(drawn.theta[K_ATP]),
        r_mitral=1.0 / 9e-6,
        r_aortic=1.0 / 1.3e-5,
        l_mitral=1e3,
        l_aortic=3e4,
        r_proximal=own["proximal_resistance_pa_s_m3"],
        c_proximal=2e-10,
        r_distal=distal,
        c_systemic=own["distal_time_constant_s"] / distal,
        r_pulmonary=1.0,  # of no account in an open circulation
        c_pulmonary=1.0,
        length_dependence=1.0,
        atrial_kick=0.0,
        atrial_delay=0.0,
    )


def kick(time_s: FloatArray, period_s: float, end_s: float) -> FloatArray:
    """Return the height of atrial contraction from 0 to 1 at times of the beat; the program's trapezoid."""
    since_end = (time_s - end_s) % period_s - period_s
    return np.interp(since_end, ATRIAL_S, (0.0, 1.0, 1.0, 0.0))


def activation(time_s: FloatArray, period_s: float, theta: FloatArray, ramp_s: float) -> FloatArray:
    """Return s(t) with u = k_ATP s - k_SR (1 - s), u the program's: trapezoids of either sign.

    Bonds form at the rate k_ATP between two ramps of ``ramp_s``, none form at either end of these, and for
    the rest of the beat u = -k_SR. The middle of the ramps is the program's at any ramp.
    """
    change_s = period_s - REFERENCE_PERIOD_S
    longer = 1.0 + ACTIVE_SHARE * change_s / ACTIVE_S
    begin_s = IDLE_S * (1.0 + (1.0 - ACTIVE_SHARE) * change_s / (REFERENCE_PERIOD_S - ACTIVE_S))
    rise_s, fall_s = (begin_s + longer * middle for middle in CREATION_S)
    half_s = 0.5 * longer * ramp_s
    at = (rise_s - half_s, rise_s + half_s, fall_s - half_s, fall_s + half_s)
    forming = np.interp(time_s, at, (0.0, 1.0, 1.0, 0.0))
    switch = (at[0] - SWITCH_S, at[0], at[3], at[3] + SWITCH_S)
    relaxing = np.interp(time_s, switch, (1.0, 0.0, 0.0, 1.0))
    k_atp, k_sr = float(theta[K_ATP]), float(theta[K_SR])
    return np.asarray((k_atp * forming + k_sr * (1.0 - relaxing)) / (k_atp + k_sr))
