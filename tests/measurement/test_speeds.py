"""The observation model on measured speeds: units, slopes, likelihood, the map of the prior's box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from scipy.integrate import quad
from scipy.stats import kstest, norm

from swesbi.measurement.likelihood import draw_speeds, log_likelihood, log_speed_sd, residuals, speed_model
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import PredictedSpeeds, WallPhases
from swesbi.population.synthetic import own_recordings
from swesbi.prior import bounds, from_logit, log_centre, log_density, log_jacobian, quantile, to_logit
from swesbi.recording.phases import nominal_phases

PRIOR = speed_case.settings().prior
PHI = speed_case.PHI


def test_the_logit_maps_the_box_and_back() -> None:
    phi = quantile(np.random.default_rng(0).random((500, 4)), PRIOR)
    np.testing.assert_allclose(from_logit(to_logit(phi, PRIOR), PRIOR), phi, rtol=1e-9)
    low, high = bounds(PRIOR)
    far = from_logit(np.array([[-900.0] * 4, [900.0] * 4]), PRIOR)
    assert np.all(far > low) and np.all(far < high)


def test_the_jacobian_is_the_derivative_of_the_map() -> None:
    eta, step = np.array([[0.3, -1.2, 2.0, 0.0]]), 1e-6
    numeric = [
        (from_logit(eta + step * unit, PRIOR) - from_logit(eta - step * unit, PRIOR))[0, j] / (2 * step)
        for j, unit in enumerate(np.eye(4))
    ]
    assert log_jacobian(eta, PRIOR)[0] == pytest.approx(np.log(numeric).sum(), abs=1e-6)


def test_the_joint_prior_integrates_to_one() -> None:
    centre = np.array([45.0, 5.0, 30.0, 2.2])
    at = log_density(centre[None], PRIOR)[0]

    def density(a: float) -> float:
        return float(np.exp(log_density(np.array([[45.0, 5.0, 30.0, a]]), PRIOR)[0] - at))

    low, high = PRIOR.passive_scale_kpa.low, PRIOR.passive_scale_kpa.high
    marginal_at_centre = 1.0 / quad(density, low, high, limit=200)[0]
    shape = np.log(np.array([low, high]) / 2.2) / 0.4
    expected = norm.pdf(0.0) / (0.4 * 2.2) / (norm.cdf(shape[1]) - norm.cdf(shape[0]))
    assert marginal_at_centre == pytest.approx(expected, rel=1e-6)


def test_speeds_have_the_stiffness_of_passive_plus_active_part() -> None:
    model = speed_case.model()
    beats = model.simulate(PHI[None])
    predicted = model.predict(PHI[None])
    active = np.interp(model.recording.phase, beats.cycle_phase, beats.active_stiffness_kpa[0], period=1.0)
    stretch = np.interp(model.recording.phase, beats.cycle_phase, beats.stretch[0], period=1.0)
    passive = np.exp(model.settings.passive.exponent_b * (stretch**2 - 1.0))
    expected = np.sqrt(1e3 * (PHI[3] * passive + active) / 3000.0)
    np.testing.assert_allclose(predicted.speed_m_s[0], expected, rtol=5e-3)


def test_the_passive_part_runs_along_each_simulations_own_stretch() -> None:
    model = speed_case.model()
    phi = np.vstack([PHI * [1.0, 1.0, 0.5, 1.0], PHI * [1.0, 1.0, 1.6, 1.0]])
    wall = model.wall_at_phases(model.simulate(phi))
    without = replace(wall, active_kpa=0.0 * wall.active_kpa, active_slope_kpa=0.0 * wall.active_slope_kpa)
    log_stiffness = 2.0 * model.predict_at(phi, without).log_speed
    apart = model.settings.passive.exponent_b * np.diff(wall.stretch**2, axis=0)
    np.testing.assert_allclose(np.diff(log_stiffness, axis=0), apart, atol=1e-12)
    assert np.abs(apart).max() > 0.05


def test_along_a_reference_beat_all_have_one_stretch_and_its_own_theta_loses_nothing() -> None:
    own = speed_case.model()
    fixed = speed_model(own.recording, own.settings.model_copy(update={"passive_beat": "reference"}))
    centre = np.append(log_centre(own.settings.passive_reference_prior), 2.2)
    np.testing.assert_allclose(
        fixed.predict(centre[None]).log_speed, own.predict(centre[None]).log_speed, atol=1e-12
    )
    slow = centre * [1.0, 1.0, 0.5, 1.0]
    apart = fixed.predict(slow[None]).log_speed - own.predict(slow[None]).log_speed
    assert np.abs(apart).max() > 0.03  # what a fixed beat misses is more than a speed's standard error


@pytest.mark.parametrize("beat", ["own", "reference"])
def test_the_slope_is_the_change_of_log_speed_with_phase(beat: str) -> None:
    case, step = speed_case.model(), 1e-4
    model = speed_model(case.recording, case.settings.model_copy(update={"passive_beat": beat}))
    moved = [
        replace(model, recording=replace(model.recording, phase=model.recording.phase + shift))
        for shift in (-step, step)
    ]
    below, above = (part.predict(PHI[None]).log_speed[0] for part in moved)
    np.testing.assert_allclose(
        model.predict(PHI[None]).slope[0], (above - below) / (2 * step), rtol=1e-4, atol=1e-4
    )


def test_noise_and_both_terms_of_discrepancy_add_in_quadrature() -> None:
    predicted = PredictedSpeeds(np.zeros((1, 3)), np.array([[0.0, 4.0, -4.0]]))
    sd = log_speed_sd(
        predicted, np.full(3, 0.03), DiscrepancySettings(speed_fraction=0.04, timing_cycle=0.03)
    )
    np.testing.assert_allclose(sd, [[0.05, 0.13, 0.13]])


def test_the_likelihood_is_the_normal_density_of_log_speeds() -> None:
    model = speed_case.model()
    phi = np.vstack([PHI, PHI * [1.1, 0.9, 1.0, 1.05]])
    predicted = model.predict(phi)
    sd = log_speed_sd(predicted, model.recording.relative_se, model.settings.discrepancy)
    expected = norm(predicted.log_speed, sd).logpdf(np.log(model.recording.speed_m_s)).sum(axis=1)
    np.testing.assert_allclose(model.log_likelihood(phi), expected)


def test_a_failed_simulation_has_likelihood_zero() -> None:
    model = speed_case.model()
    predicted = PredictedSpeeds(np.full((1, 20), np.nan), np.full((1, 20), np.nan))
    assert log_likelihood(predicted, model.recording, model.settings.discrepancy)[0] == -np.inf


def test_outside_the_box_the_posterior_is_zero_and_nothing_is_simulated() -> None:
    outside = PHI * [1.0, 10.0, 1.0, 1.0]
    values = speed_case.model().log_posterior(np.vstack([PHI, outside]))
    assert np.isfinite(values[0]) and values[1] == -np.inf


def test_drawn_speeds_have_standard_normal_residuals() -> None:
    model = speed_case.model()
    rng = np.random.default_rng(4)
    predicted = model.predict(np.repeat(PHI[None], 300, axis=0))
    speeds = draw_speeds(predicted, model.recording.errors, model.settings.discrepancy, rng)
    one = model.predict(PHI[None])
    z = [
        residuals(one, replace(model.recording, speed_m_s=row), model.settings.discrepancy)[0]
        for row in speeds
    ]
    assert kstest(np.ravel(z), "norm").pvalue > 0.01
    wrong = [value * 1.1 for value in z]  # noise 10 % too large must not pass
    assert kstest(np.ravel(wrong), "norm").pvalue < 0.01


def test_synthetic_recordings_depend_on_seed_and_name_alone() -> None:
    model = speed_case.model()
    one, same = (own_recordings(model, 5, 3, "a") for _ in range(2))
    other = own_recordings(model, 5, 3, "b")
    np.testing.assert_array_equal(one.recordings[4].speed_m_s, same.recordings[4].speed_m_s)
    assert not np.array_equal(one.phi, other.phi)


def test_between_phases_lies_the_cubic_of_values_and_slopes() -> None:
    """Errors of a smooth cycle within the bounds of Birkhoff and Priver (1967, J Math Phys 46:440)."""
    phase = nominal_phases(20)
    offset = np.random.default_rng(0).uniform(-0.5, 0.5, (3, 20))
    at = phase + offset / 20
    turn = 2.0 * np.pi
    wall = WallPhases(
        np.tile(np.sin(turn * phase), (3, 1)),
        np.tile(turn * np.cos(turn * phase), (3, 1)),
        np.tile(np.cos(turn * phase), (3, 1)),
        np.tile(-turn * np.sin(turn * phase), (3, 1)),
    )
    moved = wall.between(offset)
    of_value, of_slope = (turn / 20) ** 4 / 384, np.sqrt(3.0) / 216 * turn**4 / 20**3
    assert np.abs(moved.active_kpa - np.sin(turn * at)).max() <= of_value
    assert np.abs(moved.stretch - np.cos(turn * at)).max() <= of_value
    assert np.abs(moved.active_slope_kpa - turn * np.cos(turn * at)).max() <= of_slope
    assert np.abs(moved.stretch_slope + turn * np.sin(turn * at)).max() <= of_slope
    assert wall.between(np.zeros((3, 20))) is wall
