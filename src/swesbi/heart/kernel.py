"""Many simulations side by side: Runge-Kutta steps of one beat over SIMD lanes.

The lanes of a block lie next to each other in memory, variable by variable, and all take the same steps: the
innermost loop has no branch that depends on a simulation, so the compiler makes one instruction of several
lanes. A simulation is never stopped within a beat; the caller fills the places of those that are periodic.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.heart.compiled import equation, kernel, source_key
from swesbi.heart.equations import (
    Drive,
    Flow,
    Options,
    Parameters,
    State,
    Theta,
    atrial_rise,
    cavity,
    right_hand_side,
)

# Of double precision: two registers of 512 bits, or four of 256, so that one works while another waits.
LANES: Final = 16
STATES: Final = 8
# Recorded: displacement, active stiffness, arterial and ventricular pressure, mitral and aortic flow,
# active stress.
RECORDS: Final = 7
DISPLACEMENT: Final = 0
ACTIVE_STIFFNESS: Final = 1
VENTRICULAR_PRESSURE: Final = 3
# What a lane has of its own, variable by variable: theta; with physiology by simulation also these
# parameters, and room for its activation at the half steps of some steps.
OWN_PARAMETERS: Final = (
    "c0",
    "c2",
    "sigma_0",
    "alpha",
    "r_distal",
    "c_systemic",
    "length_dependence",
    "atrial_kick",
    "atrial_delay",
)
OWN_ACTIVATION: Final = len(Theta._fields) + len(OWN_PARAMETERS)
OWN_STEPS: Final = 8
OWN_WIDTH: Final = OWN_ACTIVATION + 2 * OWN_STEPS + 1


@equation
def moved(x: State, time_s: float, rate: State) -> State:
    """Return x + time * rate; a valve with inertance carries no negative flow."""
    return State(
        x.displacement + time_s * rate.displacement,
        x.active_stiffness + time_s * rate.active_stiffness,
        x.active_stress + time_s * rate.active_stress,
        x.arterial_pressure + time_s * rate.arterial_pressure,
        x.pulmonary_pressure + time_s * rate.pulmonary_pressure,
        max(x.mitral_flow + time_s * rate.mitral_flow, 0.0),
        max(x.aortic_flow + time_s * rate.aortic_flow, 0.0),
        x.proximal_pressure + time_s * rate.proximal_pressure,
    )


@equation
def mean_rate(a: State, b: State, c: State, d: State) -> State:
    """Return the weighted mean of the four stages, (a + 2 b + 2 c + d) / 6."""
    sixth = 1.0 / 6.0
    return State(
        sixth * (a.displacement + 2.0 * (b.displacement + c.displacement) + d.displacement),
        sixth * (a.active_stiffness + 2.0 * (b.active_stiffness + c.active_stiffness) + d.active_stiffness),
        sixth * (a.active_stress + 2.0 * (b.active_stress + c.active_stress) + d.active_stress),
        sixth
        * (a.arterial_pressure + 2.0 * (b.arterial_pressure + c.arterial_pressure) + d.arterial_pressure),
        sixth
        * (a.pulmonary_pressure + 2.0 * (b.pulmonary_pressure + c.pulmonary_pressure) + d.pulmonary_pressure),
        sixth * (a.mitral_flow + 2.0 * (b.mitral_flow + c.mitral_flow) + d.mitral_flow),
        sixth * (a.aortic_flow + 2.0 * (b.aortic_flow + c.aortic_flow) + d.aortic_flow),
        sixth
        * (a.proximal_pressure + 2.0 * (b.proximal_pressure + c.proximal_pressure) + d.proximal_pressure),
    )


@equation
def with_volume(x: State, volume: float, p: Parameters, o: Options) -> State:
    """Return the state with the displacement moved to this cavity volume by one Newton step.

    The displacement is integrated, but the volume is what the circulation exchanges: without this the
    step's error in V(y) would leak blood out of the closed loop.
    """
    reached, v_y, _ = cavity(1.0 + x.displacement / p.radius, p, o)
    return State(
        x.displacement + (volume - reached) / v_y,
        x.active_stiffness,
        x.active_stress,
        x.arterial_pressure,
        x.pulmonary_pressure,
        x.mitral_flow,
        x.aortic_flow,
        x.proximal_pressure,
    )


@equation
def with_flow(x: State, flow: Flow) -> State:
    """Return the state with these flows as the ones that the next step's inertia starts from."""
    return State(
        x.displacement,
        x.active_stiffness,
        x.active_stress,
        x.arterial_pressure,
        x.pulmonary_pressure,
        flow.mitral,
        flow.aortic,
        x.proximal_pressure,
    )


@equation
def runge_kutta_step(
    x: State, h: float, start: Drive, middle: Drive, end: Drive, theta: Theta, p: Parameters, o: Options
) -> tuple[State, Flow]:
    """Return the state after a classical Runge-Kutta step of length h, and the flows at its start."""
    # Wall inertia divides by the time since the step began, which is zero at its start: a thousandth instead.
    k1, q1 = right_hand_side(x, 1e-3 * h, start, theta, p, o)
    k2, q2 = right_hand_side(moved(x, 0.5 * h, k1), 0.5 * h, middle, theta, p, o)
    k3, q3 = right_hand_side(moved(x, 0.5 * h, k2), 0.5 * h, middle, theta, p, o)
    k4, q4 = right_hand_side(moved(x, h, k3), h, end, theta, p, o)
    volume, _, _ = cavity(1.0 + x.displacement / p.radius, p, o)
    mitral = q1.mitral + 2.0 * (q2.mitral + q3.mitral) + q4.mitral
    aortic = q1.aortic + 2.0 * (q2.aortic + q3.aortic) + q4.aortic
    after = moved(x, h, mean_rate(k1, k2, k3, k4))
    after = with_volume(after, volume + h * (mitral - aortic) * (1.0 / 6.0), p, o)
    if o.wall_inertia and not o.valve_inertance:
        after = with_flow(after, q4)
    return after, q1


@equation
def drive_at(drives: FloatArray, row: int) -> Drive:
    """Return what is prescribed at one half step."""
    return Drive(drives[row, 0], drives[row, 1], drives[row, 2], drives[row, 3], drives[row, 4])


@equation
def state_of(state: FloatArray, lane: int) -> State:
    """Return the state of one lane of a block."""
    return State(
        state[lane],
        state[LANES + lane],
        state[2 * LANES + lane],
        state[3 * LANES + lane],
        state[4 * LANES + lane],
        state[5 * LANES + lane],
        state[6 * LANES + lane],
        state[7 * LANES + lane],
    )


@equation
def write_state(state: FloatArray, lane: int, x: State) -> None:
    """Write the state of one lane of a block."""
    state[lane] = x.displacement
    state[LANES + lane] = x.active_stiffness
    state[2 * LANES + lane] = x.active_stress
    state[3 * LANES + lane] = x.arterial_pressure
    state[4 * LANES + lane] = x.pulmonary_pressure
    state[5 * LANES + lane] = x.mitral_flow
    state[6 * LANES + lane] = x.aortic_flow
    state[7 * LANES + lane] = x.proximal_pressure


@equation
def write_record(record: FloatArray, lane: int, x: State, flow: Flow) -> None:
    """Write what is recorded of one lane at the start of a step."""
    record[lane] = x.displacement
    record[LANES + lane] = x.active_stiffness
    record[2 * LANES + lane] = x.arterial_pressure
    record[3 * LANES + lane] = flow.pressure
    record[4 * LANES + lane] = flow.mitral
    record[5 * LANES + lane] = flow.aortic
    record[6 * LANES + lane] = x.active_stress


@equation
def own_parameters(p: Parameters, own: FloatArray, lane: int) -> Parameters:
    """Return the parameters with those that a lane has of its own, in the order of ``OWN_PARAMETERS``."""
    return Parameters(
        radius=p.radius,
        thickness=p.thickness,
        density=p.density,
        c0=own[3 * LANES + lane],
        c1=p.c1,
        c2=own[4 * LANES + lane],
        c3=p.c3,
        wall_viscosity=p.wall_viscosity,
        fibre_viscosity=p.fibre_viscosity,
        sigma_0=own[5 * LANES + lane],
        alpha=own[6 * LANES + lane],
        r_mitral=p.r_mitral,
        r_aortic=p.r_aortic,
        l_mitral=p.l_mitral,
        l_aortic=p.l_aortic,
        r_proximal=p.r_proximal,
        c_proximal=p.c_proximal,
        r_distal=own[7 * LANES + lane],
        c_systemic=own[8 * LANES + lane],
        r_pulmonary=p.r_pulmonary,
        c_pulmonary=p.c_pulmonary,
        length_dependence=own[9 * LANES + lane],
        atrial_kick=own[10 * LANES + lane],
        atrial_delay=own[11 * LANES + lane],
    )


@equation
def with_activation(drive: Drive, activation: float) -> Drive:
    """Return what is prescribed with another activation."""
    return Drive(activation, drive.atrial_pressure, drive.venous_pressure, drive.inflow, drive.inflow_rate)


@equation
def with_atrium(drive: Drive, time_s: float, period_s: float, p: Parameters, o: Options) -> Drive:
    """Return what is prescribed at this time of the beat, with the atrium's contraction."""
    pressure = drive.atrial_pressure + atrial_rise(time_s, period_s, p, o)
    return Drive(drive.activation, pressure, drive.venous_pressure, drive.inflow, drive.inflow_rate)


@equation
def fill_activation(own: FloatArray, activation: FloatArray, rows: IntArray, step: int) -> None:
    """Copy the lanes' activation at the half steps of the next ``OWN_STEPS`` steps side by side."""
    for lane in range(LANES):
        curve = activation[rows[lane], 2 * step : 2 * (step + OWN_STEPS) + 1]
        for k in range(curve.size):
            own[(OWN_ACTIVATION + k) * LANES + lane] = curve[k]


@lru_cache(maxsize=64)
def beat_kernel(
    options: Options, by_simulation: bool = False
) -> Callable[
    [FloatArray, FloatArray, Parameters, FloatArray, float, int, FloatArray, FloatArray, IntArray], None
]:
    """Return the compiled loop that advances blocks of ``LANES`` simulations by one beat.

    ``by_simulation``: every lane has ``OWN_PARAMETERS`` and an activation of its own.
    """
    o = options
    key = source_key()

    @kernel
    def advance_beat(
        x: FloatArray,
        own: FloatArray,
        p: Parameters,
        drives: FloatArray,
        h: float,
        stride: int,
        record: FloatArray,
        activation: FloatArray,
        rows: IntArray,
    ) -> None:
        """Advance ``x`` (blocks, STATES * LANES) in place by a beat of steps ``h``."""
        # own (blocks, width * LANES): theta, or with physiology by simulation OWN_WIDTH
        # record (blocks, samples + 1, RECORDS * LANES) takes the start of every stride-th step, then scratch
        # activation (n, 2 * steps + 1) by simulation, of which rows (blocks, LANES) names the lanes' own
        scratch = record.shape[1] - 1
        steps = (drives.shape[0] - 1) // 2
        period_s = h * steps
        for block in range(x.shape[0]):
            state, lanes = x[block], own[block]
            for step in range(steps):
                start = drive_at(drives, 2 * step)
                middle = drive_at(drives, 2 * step + 1)
                end = drive_at(drives, 2 * step + 2)
                if by_simulation and step % OWN_STEPS == 0:
                    fill_activation(lanes, activation, rows[block], step)
                now = (OWN_ACTIVATION + 2 * (step % OWN_STEPS)) * LANES
                # A scratch row instead of a condition: the loop over lanes writes without a branch.
                row = record[block, step // stride if step % stride == 0 else scratch]
                for lane in range(LANES if key >= 0 else 0):  # the key is part of what the cache compares
                    before = state_of(state, lane)
                    theta = Theta(lanes[lane], lanes[LANES + lane], lanes[2 * LANES + lane])
                    a, b, c, q = start, middle, end, p
                    if by_simulation:
                        q = own_parameters(p, lanes, lane)
                        a = with_activation(start, lanes[now + lane])
                        b = with_activation(middle, lanes[now + LANES + lane])
                        c = with_activation(end, lanes[now + 2 * LANES + lane])
                    a = with_atrium(a, h * step, period_s, q, o)
                    b = with_atrium(b, h * (step + 0.5), period_s, q, o)
                    c = with_atrium(c, h * (step + 1.0), period_s, q, o)
                    after, flow = runge_kutta_step(before, h, a, b, c, theta, q, o)
                    write_record(row, lane, before, flow)
                    write_state(state, lane, after)

    return advance_beat
