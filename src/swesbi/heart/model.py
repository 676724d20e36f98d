"""From settings and context to the numbers that the compiled loop takes; how long the muscle is active."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.activation import activations
from swesbi.heart.equations import Options, Parameters
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.parameters import K_0, K_ATP


def activation_duration_s(period_s: float, settings: ForwardModelSettings) -> float:
    """Return D_T = D sqrt(T / T_ref), the duration of the activation at a cardiac period (Bazett 1920)."""
    return float(settings.activation_duration_s * duration_ratio(period_s, settings))


def duration_ratio(period_s: float, settings: ForwardModelSettings) -> float:
    """Return sqrt(T / T_ref), by which the activation of a cardiac period is longer (Bazett 1920)."""
    return float(np.sqrt(period_s / settings.activation_reference_period_s))


def activation(time_s: FloatArray, period_s: float, settings: ForwardModelSettings) -> FloatArray:
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


def isometric_share(k_atp_per_s: FloatArray, duration_s: FloatArray | float) -> FloatArray:
    """Return 1 - exp(-k_ATP D_T): the share of k_0 that the stiffness attains, at constant length.

    The solution of the bond kinetics k_c' = k_ATP (k_0 - k_c) from rest (Chapelle et al. 2012).
    """
    return np.asarray(-np.expm1(-k_atp_per_s * duration_s))


def isometric_stiffness_kpa(parameters: FloatArray, duration_s: FloatArray | float) -> FloatArray:
    """Return k_0 (1 - exp(-k_ATP D_T)) in kPa, (n,), of theta (n, 3) or phi (n, d); D_T of each or of all."""
    return np.asarray(parameters[:, K_0] * isometric_share(parameters[:, K_ATP], duration_s))


PRESSURES: Final = [3, 4, 7]
"""Positions in ``State`` of the arterial, the pulmonary and the proximal pressure."""


@dataclass(frozen=True)
class Model:
    """One subject's heart and circulation, ready to run.

    ``drives`` (2 * steps + 1, 5) holds what is prescribed at every half step of a beat, in the order of
    ``equations.Drive``; ``start`` (8,) the state at the first R peak, in the order of ``equations.State``.
    Simulations with physiology of their own have the options ``by_simulation``.
    """

    options: Options
    parameters: Parameters
    drives: FloatArray
    step_s: float
    stride: int
    start: FloatArray
    by_simulation: Options

    @property
    def samples(self) -> int:
        """Number of recorded points of a beat."""
        return self.steps // self.stride

    @property
    def cycle_phase(self) -> FloatArray:
        """Recorded points of the beat as fractions of it, uniform from the R peak; shape (samples,)."""
        return np.asarray(np.arange(self.samples) / self.samples)

    @property
    def steps(self) -> int:
        """Number of integration steps of a beat."""
        return int(self.drives.shape[0] - 1) // 2

    @property
    def period_s(self) -> float:
        """Length of a beat."""
        return self.step_s * self.steps


@dataclass(frozen=True)
class Own:
    """What n simulations have in place of the model's: physiology, and activation (n, 2 * steps + 1)."""

    physiology: Physiology
    activation: FloatArray


def own_of(physiology: Physiology, model: Model, settings: ForwardModelSettings) -> Own:
    """Return the physiology with its activation at every half step of the model's beat."""
    duration_s = physiology.activation_duration_s * duration_ratio(model.period_s, settings)
    window_s = physiology.activation_onset_s, duration_s, physiology.activation_ramp_s
    return Own(physiology, activations(model.drives.shape[0], model.period_s, *window_s))


def options_of(settings: ForwardModelSettings, by_simulation: bool = False) -> Options:
    """Translate the options' names into the switches of the compiled loop.

    Where simulations have physiology of their own, all of its terms are switched on.
    """
    return Options(
        thin_wall=settings.geometry == "thin",
        mooney_rivlin=settings.passive_law == "mooney_rivlin",
        active_stiffness=settings.active_law == "bcs",
        second_piola=settings.stress_measure == "second_piola",
        length_dependence=by_simulation or settings.length_dependence > 0.0,
        valve_inertance=settings.valves == "inertance",
        prescribed_flow=False,
        atrial_contraction=by_simulation or settings.atrial_kick_pa > 0.0,
        wall_inertia=settings.wall_inertia,
        closed_loop=settings.circulation == "closed",
        proximal_capacitance=settings.proximal_capacitance_m3_pa is not None,
    )


def parameters_of(context: Context, settings: ForwardModelSettings) -> Parameters:
    """Collect the subject's geometry (paper, Eq. 2) and the fixed parameters; an unused one becomes 1."""
    return Parameters(
        radius=context.radius_m,
        thickness=context.thickness_m,
        density=settings.wall_density_kg_m3 or 1.0,
        c0=settings.passive_c0_pa,
        c1=settings.passive_c1,
        c2=settings.passive_c2_pa,
        c3=settings.passive_c3,
        wall_viscosity=settings.wall_viscosity_pa_s,
        fibre_viscosity=settings.fibre_viscosity_pa_s,
        sigma_0=settings.sigma_0_pa,
        alpha=settings.destruction_alpha,
        r_mitral=settings.mitral_resistance_pa_s_m3,
        r_aortic=settings.aortic_resistance_pa_s_m3,
        l_mitral=settings.mitral_inertance_pa_s2_m3 or 1.0,
        l_aortic=settings.aortic_inertance_pa_s2_m3 or 1.0,
        r_proximal=settings.proximal_resistance_pa_s_m3,
        c_proximal=settings.proximal_capacitance_m3_pa or 1.0,
        r_distal=settings.distal_resistance_pa_s_m3,
        c_systemic=settings.systemic_capacitance_m3_pa,
        r_pulmonary=settings.pulmonary_resistance_pa_s_m3,
        c_pulmonary=settings.pulmonary_capacitance_m3_pa,
        length_dependence=settings.length_dependence,
        atrial_kick=settings.atrial_kick_pa,
        atrial_delay=settings.atrial_delay_s,
    )


def steps_of(context: Context, settings: ForwardModelSettings) -> int:
    """Return the steps of a beat: the smallest multiple of the setting with steps short enough."""
    longest_s = settings.steps_per_beat * settings.maximum_step_s
    return settings.steps_per_beat * max(1, int(np.ceil(context.period_s / longest_s)))


def build_model(context: Context, settings: ForwardModelSettings, refinement: int = 1) -> Model:
    """Return the model of one subject under these settings, with ``refinement`` times as many steps."""
    steps = steps_of(context, settings) * refinement
    time_s = np.linspace(0.0, context.period_s, 2 * steps + 1)
    drives = np.zeros((time_s.size, 5))
    drives[:, 0] = activation(time_s, context.period_s, settings)
    if settings.circulation == "open":
        drives[:, 1] = settings.atrial_pressure_pa
        drives[:, 2] = settings.venous_pressure_pa
    start = np.zeros(8)
    start[0] = settings.initial_displacement_ratio * context.radius_m
    start[3] = start[7] = settings.initial_arterial_pressure_pa
    start[4] = settings.initial_pulmonary_pressure_pa
    stride = steps // settings.samples_per_beat
    options, own = (options_of(settings, by_simulation) for by_simulation in (False, True))
    parameters = parameters_of(context, settings)
    return Model(options, parameters, drives, context.period_s / steps, stride, start, own)


def cavity_volume(stretch: FloatArray, model: Model) -> FloatArray:
    """Return the cavity volume (m3) at these stretches; negative where the wall has closed the cavity.

    The formula of :func:`~swesbi.heart.equations.cavity`, which the compiled loop takes in an order
    that vectorises; the two round differently.
    """
    p = model.parameters
    delta = 0.0 if model.options.thin_wall else p.thickness / p.radius
    inner = p.radius * (stretch - 0.5 * delta / stretch**2)
    volume: FloatArray = 4.0 / 3.0 * np.pi * inner**3
    return volume


def total_volume(x: FloatArray, model: Model, physiology: Physiology | None = None) -> FloatArray:
    """Return the stressed volume (m3) of states (n, 8): cavity, systemic, pulmonary and proximal.

    With physiology of n simulations ``x`` may be one state (1, 8): the volumes that it is in each of them.
    """
    p = model.parameters
    c_systemic = p.c_systemic if physiology is None else physiology.systemic_capacitance_m3_pa
    volume = cavity_volume(1.0 + x[:, 0] / p.radius, model) + c_systemic * x[:, 3] + p.c_pulmonary * x[:, 4]
    if model.options.proximal_capacitance:
        volume = volume + p.c_proximal * x[:, 7]
    return volume


def starts(n: int, model: Model, physiology: Physiology | None = None) -> tuple[FloatArray, FloatArray]:
    """Return the states (n, 8) at the first R peak, and the stressed volumes (n,) in m3 that they hold.

    The closed loop neither gains nor loses blood, so what it starts with is what its periodic beat has, and
    where the blood lies at the start does not matter. A factor f of the stressed volume T scales what lies
    outside the cavity, V: all pressures of the start by g = (f T - V) / (T - V), so that the total is f T.

    Where f T is less than the cavity takes, the state is NaN, and the simulation counts as failed. An open
    circulation keeps no volume, so a factor other than 1 is a ValueError.
    """
    x = np.repeat(model.start[None, :], n, axis=0)
    total = np.broadcast_to(total_volume(model.start[None], model, physiology), n)
    if physiology is None:
        return x, total
    factor = physiology.stressed_volume_factor
    if not model.options.closed_loop:
        if (factor != 1.0).any():
            raise ValueError(
                "stressed_volume_factor differs from 1, but an open circulation keeps no volume; "
                "set forward_model.circulation: closed"
            )
        return x, total
    x[:, PRESSURES] *= pressure_factor(model, physiology)[:, None]
    return x, factor * total


def pressure_factor(model: Model, physiology: Physiology) -> FloatArray:
    """Return g, by which the stressed volume of n simulations scales pressures of the start; (n,)."""
    cavity_m3 = cavity_volume(1.0 + model.start[:1] / model.parameters.radius, model)
    total = total_volume(model.start[None], model, physiology)
    factor = (physiology.stressed_volume_factor * total - cavity_m3) / (total - cavity_m3)
    return np.where(factor > 0.0, factor, np.nan)
