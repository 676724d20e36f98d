from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case

from swesbi.base.arrays import FloatArray
from swesbi.measurement.derived import active_share, curve_quantities, derived, half_active_ms
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.operator import SERIES_MODULUS_KPA
from swesbi.parameters import ACTIVE_SHARE, CURVE, DERIVED_NAMES, HALF_ACTIVE, ISOMETRIC, PEAK_ACTIVE

PHASE = np.arange(20_000) / 20_000
PERIOD_S = 0.9
BASE, RISE = 4.0, 30.0
FOOT, PEAK = 0.05, 0.25


def curve(fall: FloatArray) -> FloatArray:
    """Return a curve that rises linearly from ``FOOT`` to ``PEAK``, and then is this share of its rise."""
    up = np.clip((PHASE - FOOT) / (PEAK - FOOT), 0.0, 1.0)
    return BASE + RISE * np.where(PHASE < PEAK, up, fall)


def found(fall: FloatArray) -> dict[str, float]:
    values = curve_quantities(PHASE, curve(fall)[None], PERIOD_S)
    assert tuple(values) == tuple(quantity.name for quantity in CURVE)
    return {name: float(value[0]) for name, value in values.items()}


def test_an_exponential_decay_has_its_rate_and_its_half_life() -> None:
    rate = 40.0
    half_ms, rise_ms = 1e3 * np.log(2.0) / rate, 1e3 * PERIOD_S * (PEAK - FOOT)
    expected = {
        "duration_ms": half_ms + 0.5 * rise_ms,
        "peak_kpa": BASE + RISE,
        "decay_rate_per_s": rate,
        "half_relaxation_ms": half_ms,
        "late_diastole_kpa": BASE,
    }
    assert found(np.exp(-rate * PERIOD_S * (PHASE - PEAK))) == pytest.approx(expected, rel=3e-3)


def test_a_triangle_has_half_of_its_foot_for_duration() -> None:
    end = 0.65
    fall_ms, rise_ms = 1e3 * PERIOD_S * (end - PEAK), 1e3 * PERIOD_S * (PEAK - FOOT)
    expected = {
        "duration_ms": 0.5 * (rise_ms + fall_ms),
        "peak_kpa": BASE + RISE,
        "decay_rate_per_s": 1e3 * np.log(3.0) / (0.5 * fall_ms),
        "half_relaxation_ms": 0.5 * fall_ms,
        "late_diastole_kpa": BASE,
    }
    assert found(np.clip((end - PHASE) / (end - PEAK), 0.0, 1.0)) == pytest.approx(expected, rel=1e-3)


def test_times_are_of_the_shape_and_stiffness_of_the_scale() -> None:
    one = curve(np.exp(-30.0 * (PHASE - PEAK)))
    plain, scaled = (curve_quantities(PHASE, each[None], PERIOD_S) for each in (one, 1.7 * one))
    for name, value in plain.items():
        factor = 1.7 if name.endswith("_kpa") else 1.0
        np.testing.assert_allclose(scaled[name], factor * value, rtol=1e-10)


def test_a_curve_that_failed_has_none_and_leaves_the_others_alone() -> None:
    fine = curve(np.exp(-30.0 * (PHASE - PEAK)))
    failed = np.where(PHASE > 0.5, np.nan, fine)
    both = curve_quantities(PHASE, np.array([failed, fine]), PERIOD_S)
    alone = curve_quantities(PHASE, fine[None], PERIOD_S)
    for name, (of_failed, of_fine) in both.items():
        assert np.isnan(of_failed) and of_fine == alone[name][0], name


def with_map(name: str) -> SpeedModel:
    model = speed_case.model(prior="calibrated")
    measurement = model.settings.measurement.model_copy(update={"active_stiffness_map": name})
    return replace(model, settings=model.settings.model_copy(update={"measurement": measurement}))


def test_what_is_told_of_a_heart_is_its_own_stiffness_without_the_scale_of_the_speeds() -> None:
    model, name = with_map("series_spring"), "speed_scale"
    phi = np.tile(speed_case.central_phi(model), (2, 1))
    phi[1, model.settings.prior.names.index(name)] *= 1.1
    beats = model.simulate(phi)
    told = derived(model, phi, beats)
    assert tuple(told) == DERIVED_NAMES
    for value in told.values():
        assert value[1] == value[0]
    bonds = beats.active_stiffness_kpa[0].max()
    assert told[PEAK_ACTIVE.name][0] == pytest.approx(
        bonds * SERIES_MODULUS_KPA / (bonds + SERIES_MODULUS_KPA)
    )
    total = np.add(*model.parts(phi, beats))[0]
    assert told["peak_kpa"][0] == total.max()
    np.testing.assert_allclose(model.stiffness(phi, beats)[0], total, rtol=1e-12)


def test_the_active_part_halves_by_its_own_peak_and_not_by_the_curve_s() -> None:
    rate = 25.0
    active = curve(np.exp(-rate * PERIOD_S * (PHASE - PEAK))) - BASE
    found_ms = half_active_ms(PHASE, np.array([active, 3.0 * active, np.full(PHASE.size, np.nan)]), PERIOD_S)
    assert found_ms[0] == pytest.approx(1e3 * (PEAK * PERIOD_S + np.log(2.0) / rate), rel=1e-3)
    assert found_ms[1] == found_ms[0] and np.isnan(found_ms[2])


def test_the_active_share_is_that_at_the_peak_of_the_whole() -> None:
    passive, active = np.array([[1.0, 5.0, 9.0]]), np.array([[7.0, 5.0, 0.0]])
    assert active_share(passive, active) == pytest.approx([0.5])


def test_what_is_told_of_a_beat_follows_from_its_parts() -> None:
    model = speed_case.model(prior="calibrated")
    phi = speed_case.central_phi(model)[None]
    beats = model.simulate(phi)
    told, (passive, active) = derived(model, phi, beats), model.parts(phi, beats)
    top = int((passive + active)[0].argmax())
    assert told[ACTIVE_SHARE.name][0] == pytest.approx(active[0, top] / (passive + active)[0, top])
    after = beats.cycle_phase * 1e3 * model.recording.context.period_s > told[HALF_ACTIVE.name][0]
    assert active[0, after].max() <= 0.5 * active.max()
    k_0, k_atp = phi[0, :2]
    duration_s = model.activation_duration_s(phi)[0]
    assert told[ISOMETRIC][0] == pytest.approx(k_0 * (1.0 - np.exp(-k_atp * duration_s)))
