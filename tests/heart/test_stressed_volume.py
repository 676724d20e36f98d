from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from forward_model_cases import COHORT, RICHER, SETTINGS, prior_draws

from swesbi.heart.beats import aortic_pressure_mmhg
from swesbi.heart.model import build_model, cavity_volume, own_of, starts, total_volume
from swesbi.heart.periodic import Status, advance
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate

OPEN = SETTINGS.model_copy(
    update={"circulation": "open", "atrial_pressure_pa": 1100.0, "venous_pressure_pa": 1100.0}
)
PROXIMAL = SETTINGS.model_copy(update={"proximal_capacitance_m3_pa": 2e-10})


def with_factors(factors: np.ndarray | list[float], settings: ForwardModelSettings = SETTINGS) -> Physiology:
    own = Physiology.of_settings(settings, len(factors))
    return replace(own, stressed_volume_factor=np.asarray(factors, dtype=float))


@pytest.mark.parametrize("settings", [SETTINGS, RICHER, PROXIMAL], ids=["shipped", "inertance", "proximal"])
def test_the_total_is_the_factor_times_that_of_the_settings(settings: ForwardModelSettings) -> None:
    """Whatever C_s a simulation has: the factor scales its own total, and all of it is in the pressures."""
    model, factors = build_model(COHORT["A"], settings), np.array([0.6, 0.9, 1.0, 1.4, 2.5])
    own = replace(with_factors(factors, settings), systemic_capacitance_m3_pa=np.geomspace(5e-9, 2e-8, 5))
    own_total = total_volume(np.repeat(model.start[None], 5, axis=0), model, own)
    x, total = starts(5, model, own)
    np.testing.assert_allclose(total, factors * own_total, rtol=1e-14)
    np.testing.assert_allclose(total_volume(x, model, own), total, rtol=1e-14)
    np.testing.assert_array_equal(x[:, [0, 1, 2, 5, 6]], np.repeat(model.start[None, [0, 1, 2, 5, 6]], 5, 0))
    np.testing.assert_allclose(x[:, 3] / x[:, 4], model.start[3] / model.start[4], rtol=1e-14)


def test_beats_keep_the_total() -> None:
    """Whatever R_d and C_s each simulation has."""
    theta, model = prior_draws(32, seed=31) * [1e3, 1.0, 1.0], build_model(COHORT["A"], SETTINGS)
    own = replace(
        with_factors(np.linspace(0.6, 1.8, 32)),
        systemic_capacitance_m3_pa=np.geomspace(5e-9, 2e-8, 32),
        distal_resistance_pa_s_m3=np.geomspace(2e8, 8e7, 32),
    )
    x, total = starts(32, model, own)
    for _ in range(20):
        x, _ = advance(x, theta, model, own_of(own, model, SETTINGS))
    drift_ml = 1e6 * np.abs(total_volume(x, model, own) - total).max()
    print(f"drift over 20 beats: {drift_ml:.1e} mL")
    assert drift_ml <= 1e-2


def test_a_factor_of_one_is_equal_to_the_bit() -> None:
    model = build_model(COHORT["C"], SETTINGS)
    own = replace(with_factors(np.ones(40)), systemic_capacitance_m3_pa=np.geomspace(2e-9, 4e-8, 40))
    x, total = starts(40, model, own)
    np.testing.assert_array_equal(x, np.repeat(model.start[None], 40, axis=0))
    np.testing.assert_array_equal(total, total_volume(model.start[None], model, own))


def test_the_periodic_beat_does_not_know_where_the_volume_began() -> None:
    """The same factor with the settings' volume moved between arteries, veins and cavity of the start."""
    tight = SETTINGS.model_copy(update={"periodicity_tolerance": 1e-8, "maximum_beats": 400})
    theta, factors = prior_draws(8, seed=32), np.linspace(0.7, 1.5, 8)
    model = build_model(COHORT["B"], tight)
    radius, p = model.parameters.radius, model.parameters
    moved_ratio, moved_pa = 0.0, 8e3  # of the cavity, and in the arteries
    cavity = [cavity_volume(np.array([1.0 + y / radius]), model)[0] for y in (model.start[0], 0.0)]
    left = cavity[0] - cavity[1] + p.c_systemic * (tight.initial_arterial_pressure_pa - moved_pa)
    elsewhere = tight.model_copy(
        update={
            "initial_displacement_ratio": moved_ratio,
            "initial_arterial_pressure_pa": moved_pa,
            "initial_pulmonary_pressure_pa": tight.initial_pulmonary_pressure_pa + left / p.c_pulmonary,
        }
    )
    here, there = (
        simulate(theta, COHORT["B"], settings, with_factors(factors)) for settings in (tight, elsewhere)
    )
    assert (here.status == Status.PERIODIC).all()
    np.testing.assert_allclose(there.volume_ml, here.volume_ml, rtol=1e-5)
    np.testing.assert_allclose(there.arterial_pressure_mmhg, here.arterial_pressure_mmhg, rtol=1e-5)


def test_pressures_rise_with_the_factor_up_to_a_full_heart() -> None:
    """Tension has a limit without length dependence: a fuller sphere turns it into less pressure."""
    factors = np.linspace(0.6, 1.8, 13)
    theta = np.repeat([[45.0, 5.0, 30.0]], 13, axis=0)
    beats = simulate(theta, COHORT["A"], SETTINGS, with_factors(factors))
    aortic = aortic_pressure_mmhg(beats, SETTINGS)
    systolic, diastolic = aortic.max(axis=1), aortic.min(axis=1)
    print(f"systolic {systolic.round(0)}, diastolic {diastolic.round(0)} mmHg")
    assert (np.diff(beats.end_diastolic_volume_ml) > 0.0).all()
    below_full = factors <= 1.15
    assert (np.diff(systolic[below_full]) > 0.0).all()
    assert (np.diff(diastolic[below_full]) > 0.0).all()
    assert systolic[below_full][-1] > 1.25 * systolic[0]


def test_less_than_the_cavity_takes_fails_and_leaves_the_others_alone() -> None:
    """A third of the volume does not fill a dilated cavity at rest: no start, no beat, no error."""
    dilated = replace(COHORT["A"], lvedv_ml=450.0, lvesv_ml=200.0, ivsd_cm=1.2)
    theta = prior_draws(3, seed=33)
    beats = simulate(theta, dilated, SETTINGS, with_factors([1.0, 0.3, 1.0]))
    expected = simulate(theta[[0, 2]], dilated, SETTINGS, with_factors([1.0, 1.0]))
    assert beats.status.tolist() == [Status.PERIODIC, Status.NON_FINITE, Status.PERIODIC]
    assert np.isnan(beats.volume_ml[1]).all()
    np.testing.assert_array_equal(beats.volume_ml[[0, 2]], expected.volume_ml)


def test_an_open_circulation_refuses_a_factor() -> None:
    with pytest.raises(ValueError, match="stressed_volume_factor differs from 1.*circulation: closed"):
        simulate(prior_draws(2, seed=34), COHORT["A"], OPEN, with_factors([1.0, 1.2], OPEN))
