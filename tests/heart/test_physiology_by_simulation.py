from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from forward_model_cases import COHORT, RICHER, prior_draws
from forward_model_cases import SETTINGS as SHIPPED

from swesbi.heart.model import build_model, cavity_volume, own_of, total_volume
from swesbi.heart.periodic import Status, run_to_periodic
from swesbi.heart.physiology import NAMES, RANGES, Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate, simulate_active

# Atria contract, so that every quantity matters.
SETTINGS = SHIPPED.model_copy(update={"atrial_kick_pa": 300.0})
OPEN = SETTINGS.model_copy(
    update={"circulation": "open", "atrial_pressure_pa": 1100.0, "venous_pressure_pa": 1100.0}
)
MOONEY = SETTINGS.model_copy(
    update={"passive_law": "mooney_rivlin", "passive_c0_pa": 8e3, "passive_c2_pa": 40.0}
)
SI = np.array([1e3, 1.0, 1.0])
# Of each quantity a value far from the shipped one.
OTHER = {
    "activation_onset_s": 0.06,
    "activation_duration_s": 0.28,
    "activation_ramp_s": 0.045,
    "destruction_alpha": 3.0,
    "sigma_0_pa": 110e3,
    "passive_wall_factor": 1.6,
    "distal_resistance_pa_s_m3": 1.1e8,
    "systemic_capacitance_m3_pa": 1.5e-8,
    "stressed_volume_factor": 1.3,
    "length_dependence": 0.5,
    "atrial_kick_pa": 500.0,
    "atrial_delay_s": 0.15,
}
# Largest difference of k_c, relative to its peak, from a beat with the same numbers in the settings: the
# activation by simulation is tabulated by another formula of the same function, to 1e-14.
CLOSE = 1e-10


def physiology_of(n: int, **values: object) -> Physiology:
    own = Physiology.of_settings(SETTINGS, n)
    return replace(own, **{name: np.broadcast_to(value, n).astype(float) for name, value in values.items()})


def drawn(n: int, seed: int) -> Physiology:
    """Draw physiology within a factor of 1.5 of the settings, every quantity on its own."""
    rng = np.random.default_rng(seed)
    own = Physiology.of_settings(SETTINGS, n)
    return Physiology(**{name: getattr(own, name) * 1.5 ** rng.uniform(-1.0, 1.0, n) for name in NAMES})


def changed_settings(settings: ForwardModelSettings, name: str, value: float) -> ForwardModelSettings:
    if name == "stressed_volume_factor":
        return with_volume(settings, value)
    if name != "passive_wall_factor":
        return settings.model_copy(update={name: value})
    moduli = {key: value * getattr(settings, key) for key in ("passive_c0_pa", "passive_c2_pa")}
    return settings.model_copy(update=moduli)


def with_volume(settings: ForwardModelSettings, factor: float) -> ForwardModelSettings:
    """Return settings that start context B or C with so many times the volume, by their pressures."""
    subject = "B" if settings.systemic_capacitance_m3_pa == SETTINGS.systemic_capacitance_m3_pa else "C"
    model = build_model(COHORT[subject], settings)
    cavity = float(cavity_volume(1.0 + model.start[:1] / model.parameters.radius, model)[0])
    total = float(total_volume(model.start[None], model)[0])
    pressures = ("initial_arterial_pressure_pa", "initial_pulmonary_pressure_pa")
    g = (factor * total - cavity) / (total - cavity)
    return settings.model_copy(update={name: g * getattr(settings, name) for name in pressures})


def difference(left: np.ndarray, right: np.ndarray) -> float:
    return float((np.abs(left - right) / np.abs(right).max(axis=1, keepdims=True)).max())


@pytest.mark.parametrize(
    "settings",
    [SHIPPED, SETTINGS, RICHER, OPEN, MOONEY],
    ids=["shipped", "atria", "inertance", "open", "mooney_rivlin"],
)
def test_the_settings_own_physiology_changes_nothing(settings: ForwardModelSettings) -> None:
    theta = prior_draws(40, seed=11)
    for subject in ("A", "F"):
        plain = simulate(theta, COHORT[subject], settings)
        own = simulate(theta, COHORT[subject], settings, Physiology.of_settings(settings, 40))
        np.testing.assert_array_equal(own.status, plain.status)
        np.testing.assert_array_equal(own.beats, plain.beats)
        for name in ("active_stiffness_kpa", "volume_ml", "ventricular_pressure_mmhg"):
            assert difference(getattr(own, name), getattr(plain, name)) <= CLOSE


def test_without_length_dependence_a_beat_is_that_of_the_model_without_to_the_bit() -> None:
    """A share of zero of any simulation's own, of all and of the settings', is no length dependence."""
    theta, own = prior_draws(40, seed=11), drawn(40, seed=3)
    none = replace(own, length_dependence=np.zeros(40))
    beats = simulate(theta, COHORT["A"], SETTINGS, none)
    again = simulate(theta, COHORT["A"], SETTINGS.model_copy(update={"length_dependence": 1.0}), none)
    dependent = simulate(theta, COHORT["A"], SETTINGS, replace(own, length_dependence=np.full(40, 0.5)))
    np.testing.assert_array_equal(
        beats.volume_ml[:5], simulate(theta[:5], COHORT["A"], SETTINGS, none.rows(slice(5))).volume_ml
    )
    assert difference(again.active_stiffness_kpa, beats.active_stiffness_kpa) <= CLOSE
    assert difference(dependent.active_stiffness_kpa, beats.active_stiffness_kpa) > 1e-2


@pytest.mark.parametrize("name", NAMES)
def test_one_quantity_of_one_simulation(name: str) -> None:
    """The row that differs is the beat of settings with that value, and the others are as they were."""
    theta = prior_draws(20, seed=12)
    values = np.array(getattr(Physiology.of_settings(SETTINGS, 20), name))
    values[7] = OTHER[name]
    own = simulate(theta, COHORT["B"], SETTINGS, physiology_of(20, **{name: values}))
    plain = simulate(theta, COHORT["B"], SETTINGS)
    expected = simulate(theta[7:8], COHORT["B"], changed_settings(SETTINGS, name, OTHER[name]))
    others = np.arange(20) != 7
    assert expected.status[0] == Status.PERIODIC
    assert difference(own.active_stiffness_kpa[7:8], expected.active_stiffness_kpa) <= CLOSE
    assert difference(own.volume_ml[7:8], expected.volume_ml) <= CLOSE
    assert difference(own.active_stiffness_kpa[others], plain.active_stiffness_kpa[others]) <= CLOSE
    assert difference(own.volume_ml[7:8], plain.volume_ml[7:8]) > 1e-4


@pytest.mark.parametrize("settings", [SETTINGS, RICHER], ids=["shipped", "inertance"])
def test_all_quantities_together(settings: ForwardModelSettings) -> None:
    theta = prior_draws(3, seed=13)
    beats = simulate(theta, COHORT["C"], settings, physiology_of(3, **OTHER))
    for name, value in OTHER.items():
        settings = changed_settings(settings, name, value)
    expected = simulate(theta, COHORT["C"], settings)
    assert difference(beats.active_stiffness_kpa, expected.active_stiffness_kpa) <= CLOSE
    assert difference(beats.arterial_pressure_mmhg, expected.arterial_pressure_mmhg) <= CLOSE


def test_result_depends_on_own_row_only() -> None:
    theta, own = prior_draws(75, seed=14), drawn(75, seed=14)
    together = simulate_active(theta, COHORT["B"], SETTINGS, own)
    backwards = simulate_active(theta[::-1], COHORT["B"], SETTINGS, own.rows(slice(None, None, -1)))
    alone = [
        simulate_active(theta[i : i + 1], COHORT["B"], SETTINGS, own.rows(slice(i, i + 1))) for i in range(75)
    ]
    assert (together.status == Status.PERIODIC).all()
    np.testing.assert_array_equal(together.active_stiffness_kpa, backwards.active_stiffness_kpa[::-1])
    for row, beat in enumerate(alone):
        np.testing.assert_array_equal(together.active_stiffness_kpa[row], beat.active_stiffness_kpa[0])


def test_active_stiffness_alone_is_that_of_the_whole_beat() -> None:
    theta, own = prior_draws(600, seed=15), drawn(600, seed=15)  # more than are run together
    beats = simulate(theta, COHORT["D"], SETTINGS, own)
    active = simulate_active(theta, COHORT["D"], SETTINGS, own)
    np.testing.assert_array_equal(active.active_stiffness_kpa, beats.active_stiffness_kpa)
    np.testing.assert_array_equal(active.status, beats.status)


def test_what_fails_at_the_step_of_the_settings_runs_finer_with_its_own_physiology() -> None:
    """A step too long for the stiffest walls leaves them unstable; their beats are those of the settings."""
    coarse = SETTINGS.model_copy(
        update={"maximum_step_s": 1.0, "steps_per_beat": 100, "samples_per_beat": 100}
    )
    theta = prior_draws(32, seed=16)
    own = physiology_of(32, passive_wall_factor=np.linspace(1.0, 20.0, 32))
    model = build_model(COHORT["A"], coarse)
    limits = (coarse.periodicity_tolerance, coarse.maximum_beats, coarse.extrapolation_memory)
    at_once = run_to_periodic(theta * SI, model, *limits, own=own_of(own, model, coarse))
    failed = np.flatnonzero(at_once.status != Status.PERIODIC)
    print(f"{failed.size} of 32 fail at the coarse step")
    assert 0 < failed.size < 32
    beats = simulate(theta, COHORT["A"], coarse, own)
    assert (beats.status == Status.PERIODIC).all()
    for row in failed[:3]:
        settings = changed_settings(coarse, "passive_wall_factor", own.passive_wall_factor[row])
        expected = simulate(theta[row : row + 1], COHORT["A"], settings).active_stiffness_kpa
        assert difference(beats.active_stiffness_kpa[row : row + 1], expected) <= CLOSE


@pytest.mark.parametrize("run", [simulate, simulate_active], ids=["simulate", "simulate_active"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("factor", [np.nan, -1.0, 1e3])
def test_a_value_outside_its_range_is_refused_by_row(run: object, name: str, factor: float) -> None:
    values = np.array(getattr(physiology_of(3, destruction_alpha=1.5, length_dependence=0.5), name))
    values[1] *= factor
    low, high = RANGES[name]
    with pytest.raises(ValueError) as refused:
        run(prior_draws(3, seed=1), COHORT["A"], SETTINGS, physiology_of(3, **{name: values}))  # type: ignore[operator]
    message = str(refused.value)
    assert f"physiology row 1: {name} = {values[1]:g}" in message
    assert f"[{low:g}, {high:g}]" in message


@pytest.mark.parametrize("values", [np.ones(4), np.ones((3, 1)), np.array(1.0)])
def test_a_wrong_shape_is_refused_by_name(values: np.ndarray) -> None:
    own = replace(Physiology.of_settings(SETTINGS, 3), passive_wall_factor=values)
    with pytest.raises(ValueError, match=r"passive_wall_factor has shape .*expected \(3,\)"):
        simulate(prior_draws(3, seed=1), COHORT["A"], SETTINGS, own)
