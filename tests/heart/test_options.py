from __future__ import annotations

import math

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS

from swesbi.heart.equations import (
    FRANK_STARLING,
    available_bonds,
    cavity,
    exponential,
    passive_stress,
    resistive_flow,
)
from swesbi.heart.model import Model, cavity_volume, options_of, parameters_of, steps_of
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate

CENTRE = np.array([[45.0, 5.0, 30.0]])
OPTIONS, PARAMETERS = options_of(SETTINGS), parameters_of(COHORT["A"], SETTINGS)
OPEN = {"circulation": "open", "atrial_pressure_pa": 1100.0, "venous_pressure_pa": 1100.0}
INERTANCE = {"valves": "inertance", "maximum_step_s": 7e-4}
PROXIMAL = {"proximal_capacitance_m3_pa": 2e-10, "maximum_step_s": 7e-4, "valves": "inertance"}
MOONEY = {"passive_law": "mooney_rivlin", "passive_c0_pa": 8e3, "passive_c2_pa": 40.0}
LITTLE_INERTANCE = {
    "valves": "inertance",
    "mitral_inertance_pa_s2_m3": 100.0,
    "aortic_inertance_pa_s2_m3": 3e3,
}


def changed(*updates: dict[str, object]) -> ForwardModelSettings:
    plain = SETTINGS.to_plain()
    for update in updates:
        plain |= update
    return ForwardModelSettings.from_plain(plain)


@pytest.mark.parametrize(
    ("x", "error"), [(0.0, 0.0), (1e-3, 1e-14), (0.5, 1e-14), (4.0, 4e-13), (10.0, 6e-10), (40.0, 4e-5)]
)
def test_exponential(x: float, error: float) -> None:
    assert exponential(x) == pytest.approx(math.exp(x), rel=error)


@pytest.mark.parametrize("strain", [-0.3, -0.1, 0.0, 0.07, 0.15, 0.3, 0.6, 1.0, 1.5])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0, 1.5])
def test_length_dependence_is_a_share_of_the_table_that_leaves_some_bonds_or_none(
    strain: float, share: float
) -> None:
    """A share beyond its range, or a rounding, leaves none; without one all are available to the bit."""
    e, n_0 = np.array(FRANK_STARLING).T
    found = available_bonds(strain, share, OPTIONS._replace(length_dependence=True))
    expected = max(0.0, 1.0 + share * (float(np.interp(strain, e, n_0)) - 1.0))
    assert found == pytest.approx(expected, abs=1e-12)
    assert found >= 0.0
    assert share > 0.0 or found == 1.0
    assert available_bonds(strain, share, OPTIONS._replace(length_dependence=False)) == 1.0


@pytest.mark.parametrize("stretch", [0.85, 1.0, 1.15, 1.3])
def test_passive_stress_is_the_slope_of_the_energy(stretch: float) -> None:
    p, step = PARAMETERS, 1e-5

    def energy(a: float) -> float:
        c = a * a
        j = 2.0 * c + c**-2 - 3.0
        return p.c0 * math.exp(p.c1 * j * j) + p.c2 * math.exp(p.c3 * (c - 1.0) ** 2)

    slope = (energy(stretch + step) - energy(stretch - step)) / (2.0 * step)
    assert passive_stress(stretch, p, OPTIONS) == pytest.approx(slope, rel=1e-6, abs=1e-3)


@pytest.mark.parametrize("thin", [False, True])
def test_cavity_derivatives(thin: bool) -> None:
    options, p, step = OPTIONS._replace(thin_wall=thin), PARAMETERS, 1e-6
    low, high = (cavity(1.1 + sign * step / p.radius, p, options) for sign in (-1.0, 1.0))
    _, v_y, v_yy = cavity(1.1, p, options)
    assert v_y == pytest.approx((high[0] - low[0]) / (2.0 * step), rel=1e-7)
    assert v_yy == pytest.approx((high[1] - low[1]) / (2.0 * step), rel=1e-7)


@pytest.mark.parametrize("thin", [False, True])
def test_the_volume_of_states_is_the_loop_s(thin: bool) -> None:
    """Both compute V(lambda), in orders of operations of their own."""
    options = OPTIONS._replace(thin_wall=thin)
    model = Model(options, PARAMETERS, np.zeros((3, 5)), 1.0, 1, np.zeros(8), options)
    stretch = np.linspace(0.8, 1.6, 9)
    expected = [cavity(one, PARAMETERS, options)[0] for one in stretch]
    np.testing.assert_allclose(cavity_volume(stretch, model), expected, rtol=1e-13)


@pytest.mark.parametrize("p0", [-2e3, 800.0, 5e3, 1.2e4, 4e4])
@pytest.mark.parametrize("p_ar", [9e3, 500.0])
def test_resistive_valves_meet_their_own_equations(p0: float, p_ar: float) -> None:
    b, p_la, r_mi, r_ao = 4e5, 1.1e3, 1.11e5, 7.1e6
    flow = resistive_flow(p0, b, p_la, p_ar, r_mi, r_ao)
    assert flow.mitral == pytest.approx(max(p_la - flow.pressure, 0.0) / r_mi, abs=1e-15)
    assert flow.aortic == pytest.approx(max(flow.pressure - p_ar, 0.0) / r_ao, abs=1e-15)
    assert flow.pressure == pytest.approx(p0 + b * (flow.mitral - flow.aortic), abs=1e-6)


COMPOSITIONS = {
    "thin": {"geometry": "thin"},
    "thin mooney_rivlin second_piola": {"geometry": "thin", "stress_measure": "second_piola"} | MOONEY,
    "tau_only inertia": {"active_law": "tau_only", "wall_inertia": True},
    "inertance": INERTANCE,
    "inertance inertia length_dependence": INERTANCE | {"wall_inertia": True, "length_dependence": 1.0},
    "open": OPEN,
    "open inertance inertia proximal": OPEN | PROXIMAL | {"wall_inertia": True},
    "proximal": PROXIMAL,
    "thin tau_only open mooney_rivlin": {"geometry": "thin", "active_law": "tau_only"} | OPEN | MOONEY,
}


@pytest.mark.slow
@pytest.mark.parametrize("update", COMPOSITIONS.values(), ids=COMPOSITIONS)
def test_options_compose(update: dict[str, object]) -> None:
    beats = simulate(CENTRE, COHORT["A"], changed(update))
    assert Status(beats.status[0]) is Status.PERIODIC
    assert 0.2 < beats.ejection_fraction[0] < 0.85
    assert beats.arterial_pressure_mmhg.min() > 30.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("update", "largest_ml"),
    [
        ({"wall_inertia": True, "wall_density_kg_m3": 1e-3}, 0.05),
        (LITTLE_INERTANCE, 0.5),
        ({"valves": "inertance", "wall_inertia": True}, 3.0),
        ({"wall_inertia": True}, 1.0),
    ],
    ids=["no mass", "little inertance", "richer", "mass"],
)
def test_limits_of_inertia(update: dict[str, object], largest_ml: float) -> None:
    """Without mass nothing changes, and what inertia there is changes little."""
    fine = {"steps_per_beat": 8000}
    plain = simulate(CENTRE, COHORT["A"], changed(fine)).volume_ml
    other = simulate(CENTRE, COHORT["A"], changed(fine, update)).volume_ml
    difference = np.abs(other - plain).max()
    print(f"{update}: {difference:.3f} mL")
    assert difference < largest_ml


@pytest.mark.slow
def test_wall_inertia_is_the_same_with_either_valve() -> None:
    """The backward difference of resistive valves tends to the closed form of little inertance."""
    mass = {"wall_inertia": True, "wall_density_kg_m3": 2e4, "steps_per_beat": 16_000}
    resistive = simulate(CENTRE, COHORT["A"], changed(mass)).ventricular_pressure_mmhg
    inertance = simulate(CENTRE, COHORT["A"], changed(mass, LITTLE_INERTANCE)).ventricular_pressure_mmhg
    difference = float(np.sqrt(np.mean((resistive - inertance) ** 2)))
    print(f"RMSE {difference:.3f} mmHg")
    assert difference < 1.0


def test_slow_hearts_take_more_steps() -> None:
    assert steps_of(COHORT["A"], SETTINGS) == SETTINGS.steps_per_beat
    slow = COHORT["A"].__class__(**{**COHORT["A"].__dict__, "hr_bpm": 40.0})
    assert steps_of(slow, SETTINGS) == 2 * SETTINGS.steps_per_beat
