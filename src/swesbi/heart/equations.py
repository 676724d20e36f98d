"""The equations of the left ventricle and its circulation, one function per law, in SI units.

Symbols follow Caruel et al. (2014, Biomech. Model. Mechanobiol. 13:897) for the spherical ventricle and
Chapelle et al. (2012, Int. J. Multiscale Comput. Eng. 10:189) for the active law: displacement ``y`` of the
mid-wall, stretch ``lambda = 1 + y / R_0``, ``C = lambda^2``, fibre strain ``e = y / R_0``.

Every function is a scalar expression without branches that exclude each other's arithmetic, so that the
compiler turns a loop over simulations into SIMD code.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from swesbi.heart.compiled import equation

# Vertices (e, n_0) of the length dependence of PhysioBlocks 2.0.1's human heart (Inria); flat outside.
FRANK_STARLING = (
    (-0.1668, 0.0),
    (-0.0073, 0.5614),
    (0.0534, 0.7748),
    (0.0969, 0.8933),
    (0.1326, 0.9618),
    (0.2016, 1.0),
    (0.4663, 1.0),
    (0.9187, 0.1075),
    (1.1762, 0.0),
)

# Atrial contraction: how long it lasts, and how long before the R peak it starts at the earliest.
ATRIAL_DURATION_S = 0.14
ATRIAL_EARLIEST_S = 0.26


class Options(NamedTuple):
    """Which terms the right-hand side has; constants at compile time."""

    thin_wall: bool
    mooney_rivlin: bool
    active_stiffness: bool
    second_piola: bool
    length_dependence: bool
    valve_inertance: bool
    prescribed_flow: bool
    atrial_contraction: bool
    wall_inertia: bool
    closed_loop: bool
    proximal_capacitance: bool


class Parameters(NamedTuple):
    """Numbers of one subject's heart and circulation (SI units)."""

    radius: float
    thickness: float
    density: float
    c0: float
    c1: float
    c2: float
    c3: float
    wall_viscosity: float
    fibre_viscosity: float
    sigma_0: float
    alpha: float
    r_mitral: float
    r_aortic: float
    l_mitral: float
    l_aortic: float
    r_proximal: float
    c_proximal: float
    r_distal: float
    c_systemic: float
    r_pulmonary: float
    c_pulmonary: float
    length_dependence: float
    atrial_kick: float
    atrial_delay: float


class State(NamedTuple):
    """What is integrated in time; a term that the options leave out stays at its initial value."""

    displacement: float
    active_stiffness: float
    active_stress: float
    arterial_pressure: float
    pulmonary_pressure: float
    mitral_flow: float
    aortic_flow: float
    proximal_pressure: float


class Drive(NamedTuple):
    """What is prescribed in time: activation in [0, 1], pressures (Pa), net inflow (m3/s) and its rate."""

    activation: float
    atrial_pressure: float
    venous_pressure: float
    inflow: float
    inflow_rate: float


class Theta(NamedTuple):
    """The inferred parameters: k_0 (Pa), k_ATP (1/s), k_SR (1/s)."""

    k_0: float
    k_atp: float
    k_sr: float


class Flow(NamedTuple):
    """Ventricular pressure (Pa) and the flows through the two valves (m3/s)."""

    pressure: float
    mitral: float
    aortic: float


@equation
def exponential(x: float) -> float:
    """Return exp(x), x >= 0: Taylor series of exp(x / 64) to the seventh power, squared six times.

    Relative error 4e-13 up to x = 4, 6e-10 up to 10, 4e-5 up to 40 (stresses beyond any heart's). Unlike the
    library's exp it is plain arithmetic, which vectorises on every processor.
    """
    r = x * 0.015625
    r2 = r * r
    r4 = r2 * r2
    low = (1.0 + r) + r2 * (1.0 / 2.0 + r * (1.0 / 6.0))
    middle = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0))
    p = low + r4 * middle
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    return p * p


@equation
def cavity(stretch: float, p: Parameters, o: Options) -> tuple[float, float, float]:
    """Return the cavity volume V (m3) and its derivatives V_y (m2) and V_yy (m) along the displacement.

    V = 4/3 pi r_c^3; mid-wall: r_c = R_0 (lambda - delta / (2 lambda^2)) (Caruel et al. 2014); thin:
    r_c = R_0 lambda.
    """
    delta = 0.0 if o.thin_wall else p.thickness / p.radius
    inverse = 1.0 / stretch
    rho = stretch - 0.5 * delta * inverse * inverse
    slope = 1.0 + delta * inverse * inverse * inverse
    curvature = -3.0 * delta * inverse * inverse * inverse * inverse
    area = 4.0 * pi * p.radius * p.radius
    volume = area * p.radius * rho * rho * rho * (1.0 / 3.0)
    v_y = area * rho * rho * slope
    v_yy = 4.0 * pi * p.radius * (2.0 * rho * slope * slope + rho * rho * curvature)
    return volume, v_y, v_yy


@equation
def atrial_rise(time_s: float, period_s: float, p: Parameters, o: Options) -> float:
    """Return what atrial contraction adds to the atrial pressure (Pa) at a time after the R peak.

    P_a (4 x (1 - x))^2 for 0 <= x <= 1, x = (t - d_a + 0.26 s) / 0.14 s: of this beat's contraction, which
    may last beyond the R peak, and of the next one's. Mitral A waves last 113 to 138 ms (Nagueh et al. 2009,
    Eur. J. Echocardiogr. 10:165).
    """
    if not o.atrial_contraction:
        return 0.0
    x = (time_s - p.atrial_delay + ATRIAL_EARLIEST_S) * (1.0 / ATRIAL_DURATION_S)
    y = (time_s - period_s - p.atrial_delay + ATRIAL_EARLIEST_S) * (1.0 / ATRIAL_DURATION_S)
    before = max(4.0 * x * (1.0 - x), 0.0)
    after = max(4.0 * y * (1.0 - y), 0.0)
    return p.atrial_kick * (before * before + after * after)


@equation
def passive_stress(stretch: float, p: Parameters, o: Options) -> float:
    """Return W'(lambda) (Pa) in equibiaxial stretch of an incompressible wall.

    Exponential (Caruel et al. 2014): W = C_0 exp(C_1 J^2) + C_2 exp(C_3 (C - 1)^2), J = 2 C + C^-2 - 3.
    Mooney-Rivlin: W' = 4 (lambda - lambda^-5) (W_1 + C W_2), with W_1, W_2 in the places of C_0, C_2.
    """
    inverse = 1.0 / stretch
    c = stretch * stretch
    c_inverse = inverse * inverse
    shear = stretch * (1.0 - c_inverse * c_inverse * c_inverse)
    if o.mooney_rivlin:
        return 4.0 * shear * (p.c0 + c * p.c2)
    j = 2.0 * c + c_inverse * c_inverse - 3.0
    isotropic = 8.0 * p.c0 * p.c1 * j * shear * exponential(p.c1 * j * j)
    fibre = 4.0 * p.c2 * p.c3 * (c - 1.0) * stretch * exponential(p.c3 * (c - 1.0) * (c - 1.0))
    return isotropic + fibre


@equation
def viscosity(stretch: float, p: Parameters) -> float:
    """Return the wall's viscous coefficient (Pa s): 2 eta (C + 2 C^-5) + mu (Caruel et al. 2014)."""
    inverse = 1.0 / stretch
    c = stretch * stretch
    c_inverse = inverse * inverse
    fourth = c_inverse * c_inverse * c_inverse * c_inverse
    return 2.0 * p.wall_viscosity * (c + 2.0 * fourth * c_inverse) + p.fibre_viscosity


@equation
def available_bonds(strain: float, share: float, o: Options) -> float:
    """Return n_0(e) = max(0, 1 + gamma (F(e) - 1)), the fraction of bonds that the filaments' overlap allows.

    F is the table ``FRANK_STARLING``; its share gamma is 0 without length dependence, where n_0 is 1 to the
    bit, and 1 for the whole of it.
    """
    if not o.length_dependence:
        return 1.0
    value = 0.0
    for i in range(len(FRANK_STARLING) - 1):
        left, low = FRANK_STARLING[i]
        right, high = FRANK_STARLING[i + 1]
        value += (high - low) / (right - left) * (min(max(strain, left), right) - left)
    return max(1.0 + share * (value - 1.0), 0.0)


@equation
def activation_rate(activation: float, theta: Theta) -> float:
    """Return u (1/s) = k_ATP s - k_SR (1 - s): contraction rate while active, relaxation rate otherwise."""
    return theta.k_atp * activation - theta.k_sr * (1.0 - activation)


@equation
def active_rates(
    x: State, strain_rate: float, u: float, theta: Theta, p: Parameters, o: Options
) -> tuple[float, float]:
    """Return k_c' and tau_c' (Chapelle et al. 2012, with the strain of a rigid series element).

    k_c'   = -(|u| + alpha |e'|) k_c   + n_0 k_0 u_+
    tau_c' = -(|u| + alpha |e'|) tau_c + n_0 sigma_0 u_+ + e' k_c;  ``tau_only`` drops k_c and alpha.
    """
    creation = max(u, 0.0) * available_bonds(x.displacement / p.radius, p.length_dependence, o)
    if not o.active_stiffness:
        return 0.0, creation * p.sigma_0 - abs(u) * x.active_stress
    destruction = abs(u) + p.alpha * abs(strain_rate)
    stiffness_rate = creation * theta.k_0 - destruction * x.active_stiffness
    stress_rate = creation * p.sigma_0 - destruction * x.active_stress + strain_rate * x.active_stiffness
    return stiffness_rate, stress_rate


@equation
def resistive_flow(p0: float, b: float, p_la: float, p_ar: float, r_mi: float, r_ao: float) -> Flow:
    """Return pressure and flows of ideal resistive valves in closed form.

    The wall gives P_v = P_0 + b (Q_mi - Q_ao), the valves Q_mi = (P_la - P_v)_+ / R_mi and
    Q_ao = (P_v - P_ar)_+ / R_ao: one monotone, piecewise linear equation for P_v.
    """
    reverse = b * max(p_la - p_ar, 0.0)  # both valves are open where the arterial pressure is the lower one
    g_mi = 1.0 / r_mi if p0 < p_la + reverse / r_ao else 0.0
    g_ao = 1.0 / r_ao if p0 > p_ar - reverse / r_mi else 0.0
    pressure = (p0 + b * (g_mi * p_la + g_ao * p_ar)) / (1.0 + b * (g_mi + g_ao))
    return Flow(pressure, g_mi * max(p_la - pressure, 0.0), g_ao * max(pressure - p_ar, 0.0))


@equation
def inertial_flow_rates(
    x: State, p_e: float, m: float, p_la: float, p_ar: float, r_ao: float, p: Parameters
) -> tuple[float, float, float]:
    """Return P_v, Q_mi' and Q_ao' of valves with inertance, L Q' = dP - R Q while open, in closed form.

    The wall gives P_v = P_e + m (Q_mi' - Q_ao'), m its own inertance. A valve is open while it carries
    flow or its pressure difference opens it.
    """
    carries_mi = 1.0 if x.mitral_flow > 0.0 else 0.0
    carries_ao = 1.0 if x.aortic_flow > 0.0 else 0.0
    drive_mi = (p_la - p.r_mitral * x.mitral_flow) / p.l_mitral
    drive_ao = (p_ar + r_ao * x.aortic_flow) / p.l_aortic
    first = (p_e + m * (carries_mi * drive_mi + carries_ao * drive_ao)) / (
        1.0 + m * (carries_mi / p.l_mitral + carries_ao / p.l_aortic)
    )
    open_mi = 1.0 if x.mitral_flow > 0.0 or p_la > first else 0.0
    open_ao = 1.0 if x.aortic_flow > 0.0 or first > p_ar else 0.0
    pressure = (p_e + m * (open_mi * drive_mi + open_ao * drive_ao)) / (
        1.0 + m * (open_mi / p.l_mitral + open_ao / p.l_aortic)
    )
    mitral_rate = open_mi * (drive_mi - pressure / p.l_mitral)
    aortic_rate = open_ao * (pressure / p.l_aortic - drive_ao)
    return pressure, mitral_rate, aortic_rate


@equation
def chamber(
    x: State, stage_s: float, drive: Drive, p: Parameters, o: Options
) -> tuple[float, Flow, float, float]:
    """Return y' (m/s), pressure and flows, and the rates of the flows (m3/s2) where they are states.

    Wall: P_v V_y = 4 pi R_0^2 (rho d_0 y'' + (d_0 / R_0) (W' + (2 eta (C + 2 C^-5) + mu) e' + tau_c)), and
    V_y y' = Q_mi - Q_ao. The stress measure ``second_piola`` lets tau_c enter as lambda tau_c. Wall inertia
    with resistive valves takes y'' by a backward difference over the time ``stage_s`` since the step began.
    """
    stretch = 1.0 + x.displacement / p.radius
    _, v_y, v_yy = cavity(stretch, p, o)
    area = 4.0 * pi * p.radius * p.radius
    inverse = 1.0 / v_y
    a = area * p.thickness / p.radius * inverse
    active = stretch * x.active_stress if o.second_piola else x.active_stress
    p0 = a * (passive_stress(stretch, p, o) + active)
    b = a * viscosity(stretch, p) / p.radius * inverse
    p_la = drive.atrial_pressure + (x.pulmonary_pressure if o.closed_loop else 0.0)
    p_ar = x.proximal_pressure if o.proximal_capacitance else x.arterial_pressure
    r_ao = p.r_aortic if o.proximal_capacitance else p.r_aortic + p.r_proximal
    m = area * p.density * p.thickness / (v_y * v_y) if o.wall_inertia else 0.0
    if o.prescribed_flow:
        velocity = drive.inflow / v_y
        pressure = p0 + b * drive.inflow + m * (drive.inflow_rate - v_yy * velocity * velocity)
        flow = Flow(pressure, max(drive.inflow, 0.0), max(-drive.inflow, 0.0))
        return velocity, flow, 0.0, 0.0
    inflow = x.mitral_flow - x.aortic_flow
    if o.valve_inertance:
        velocity = inflow / v_y
        p_e = p0 + b * inflow - m * v_yy * velocity * velocity
        pressure, mitral_rate, aortic_rate = inertial_flow_rates(x, p_e, m, p_la, p_ar, r_ao, p)
        return velocity, Flow(pressure, x.mitral_flow, x.aortic_flow), mitral_rate, aortic_rate
    if o.wall_inertia:
        velocity = inflow / v_y
        p0 = p0 - m * (inflow / stage_s + v_yy * velocity * velocity)
        b = b + m / stage_s
    flow = resistive_flow(p0, b, p_la, p_ar, p.r_mitral, r_ao)
    return (flow.mitral - flow.aortic) * inverse, flow, 0.0, 0.0


@equation
def circulation_rates(
    x: State, flow: Flow, drive: Drive, p: Parameters, o: Options
) -> tuple[float, float, float]:
    """Return P_s', P_pul' and the proximal P_p' of the systemic RCR and the pulmonary RC.

    C_s P_s' = Q_in - Q_s, Q_s = (P_s - P_pul) / (R_d + R_pul), C_pul P_pul' = Q_s - Q_mi. In an open
    circulation the venous pressure is prescribed and Q_s = (P_s - P_ven) / R_d. Q_in is Q_ao, or
    (P_p - P_s) / R_p behind a proximal capacitance C_p P_p' = Q_ao - Q_in.
    """
    entering = flow.aortic
    proximal_rate = 0.0
    if o.proximal_capacitance:
        entering = (x.proximal_pressure - x.arterial_pressure) / p.r_proximal
        proximal_rate = (flow.aortic - entering) / p.c_proximal
    if o.closed_loop:
        leaving = (x.arterial_pressure - x.pulmonary_pressure) / (p.r_distal + p.r_pulmonary)
        return (
            (entering - leaving) / p.c_systemic,
            (leaving - flow.mitral) / p.c_pulmonary,
            proximal_rate,
        )
    leaving = (x.arterial_pressure - drive.venous_pressure) / p.r_distal
    return (entering - leaving) / p.c_systemic, 0.0, proximal_rate


@equation
def right_hand_side(
    x: State, stage_s: float, drive: Drive, theta: Theta, p: Parameters, o: Options
) -> tuple[State, Flow]:
    """Return the time derivative of the state, and the pressure and flows that belong to it."""
    velocity, flow, mitral_rate, aortic_rate = chamber(x, stage_s, drive, p, o)
    u = activation_rate(drive.activation, theta)
    stiffness_rate, stress_rate = active_rates(x, velocity / p.radius, u, theta, p, o)
    arterial_rate, pulmonary_rate, proximal_rate = circulation_rates(x, flow, drive, p, o)
    rate = State(
        velocity,
        stiffness_rate,
        stress_rate,
        arterial_rate,
        pulmonary_rate,
        mitral_rate,
        aortic_rate,
        proximal_rate,
    )
    return rate, flow
