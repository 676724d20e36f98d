from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from scipy.integrate import quad
from scipy.stats import norm

from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import SimulationFailure
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel, log_speed_sd
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import MeasuredBy, PredictedSpeeds, WallPhases, shortening
from swesbi.population.recordings import own_recordings
from swesbi.prior import bounds, from_logit, log_density, log_jacobian, quantile, to_logit
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
    centre = np.array([45.0, 5.0, 30.0, 4.0])
    at = log_density(centre[None], PRIOR)[0]

    def density(a: float) -> float:
        return float(np.exp(log_density(np.array([[45.0, 5.0, 30.0, a]]), PRIOR)[0] - at))

    low, high = PRIOR.passive_stiffness_kpa.low, PRIOR.passive_stiffness_kpa.high
    marginal_at_centre = 1.0 / quad(density, low, high, limit=200)[0]
    shape = np.log(np.array([low, high]) / 4.0) / 0.4
    expected = norm.pdf(0.0) / (0.4 * 4.0) / (norm.cdf(shape[1]) - norm.cdf(shape[0]))
    assert marginal_at_centre == pytest.approx(expected, rel=1e-6)


def test_speeds_have_the_stiffness_of_passive_plus_active_part() -> None:
    """The passive part has its three numbers where the wall is longest, half-way and shortest."""
    model = speed_case.model(prior="calibrated")
    phi, prior = speed_case.central_phi(model), model.settings.prior
    for name, value in (("passive_ratio", 0.3), ("passive_middle_factor", 0.8)):
        phi[prior.names.index(name)] = value
    beats = model.simulate(phi[None])
    stretch = beats.stretch[0]
    known = np.log(PHI[3] * np.array([1.0, 0.8 * np.sqrt(0.3), 0.3]))
    log_passive = np.polyval(
        np.polyfit([stretch.max(), 0.5 * np.ptp(stretch) + stretch.min(), stretch.min()], known, 2), stretch
    )
    total = np.exp(log_passive) + beats.active_stiffness_kpa[0]
    expected = np.sqrt(1e3 * np.interp(model.recording.phase, beats.cycle_phase, total, period=1.0) / 3000.0)
    np.testing.assert_allclose(model.predict(phi[None]).speed_m_s[0], expected, rtol=5e-3)
    np.testing.assert_allclose(model.stiffness(phi[None], beats)[0], total, rtol=1e-9)


def test_the_passive_law_meets_its_three_numbers_and_its_slope_is_its_derivative() -> None:
    """a at the largest stretch, a m sqrt(r) half-way, a r at the smallest; a heart in each row."""
    a, r, m = np.array([4.0, 2.5, 5.0]), np.array([0.3, 1.0, 6.0]), np.array([0.8, 1.5, 1.0])
    by, step = MeasuredBy(a, r, m), 1e-6
    met = by.passive_kpa(np.tile([0.0, 0.5, 1.0], (3, 1)))
    np.testing.assert_allclose(met, np.column_stack([a, a * m * np.sqrt(r), a * r]), rtol=1e-14)
    at = np.tile([0.1, 0.4, 0.9], (3, 1))
    above, below = (np.log(by.passive_kpa(at + side)) for side in (step, -step))
    np.testing.assert_allclose(by.passive_log_slope(at), (above - below) / (2 * step), atol=1e-8)


def test_shortening_is_the_share_of_the_way_from_the_own_largest_stretch_to_the_own_smallest() -> None:
    stretch = np.array([[1.1, 1.0, 0.9, 1.05], [1.3, 1.2, 1.25, 1.3], [1.02] * 4])
    expected = [[0.0, 0.5, 1.0, 0.25], [0.0, 1.0, 0.5, 0.0], [0.0] * 4]  # the last does not move
    np.testing.assert_allclose(shortening(stretch), expected, atol=1e-14)


def test_the_slope_is_the_change_of_log_speed_with_phase() -> None:
    model, step = speed_case.model(prior="calibrated"), 1e-4
    phi = speed_case.central_phi(model)
    phi[model.settings.prior.names.index("passive_ratio")] = 0.3
    moved = [
        replace(model, recording=replace(model.recording, phase=model.recording.phase + shift))
        for shift in (-step, step)
    ]
    below, above = (part.predict(phi[None]).log_speed[0] for part in moved)
    np.testing.assert_allclose(
        model.predict(phi[None]).slope[0], (above - below) / (2 * step), rtol=1e-4, atol=1e-4
    )


def test_noise_and_both_terms_of_discrepancy_add_in_quadrature() -> None:
    predicted = PredictedSpeeds(np.zeros((1, 3)), np.array([[0.0, 4.0, -4.0]]))
    sd = log_speed_sd(
        predicted, np.full(3, 0.03), DiscrepancySettings(speed_fraction=0.04, timing_cycle=0.03)
    )
    np.testing.assert_allclose(sd, [[0.05, 0.13, 0.13]])


def test_synthetic_recordings_depend_on_seed_and_name_alone() -> None:
    model = speed_case.model()
    one, same = (own_recordings(model, 5, 3, "a") for _ in range(2))
    other = own_recordings(model, 5, 3, "b")
    np.testing.assert_array_equal(one.recordings[4].speed_m_s, same.recordings[4].speed_m_s)
    assert not np.array_equal(one.phi, other.phi)


def test_a_prior_of_hearts_that_do_not_beat_ends_with_an_explanation(monkeypatch: pytest.MonkeyPatch) -> None:
    model = speed_case.model()
    beats, calls = model.simulate(np.tile(PHI, (3, 1))), []

    def failing(_: SpeedModel, phi: np.ndarray) -> Beats:
        calls.append(phi.copy())
        assert len(calls) < 1000, "it does not end"
        status = np.array([Status.PERIODIC, Status.OUT_OF_RANGE, Status.PERIODIC], np.int8)
        return replace(beats, status=status)

    monkeypatch.setattr(SpeedModel, "simulate", failing)
    with pytest.raises(SimulationFailure, match=r"subject T: 100 draws .*out_of_range.*Narrow the prior"):
        own_recordings(model, 3, 3, "a")
    first, second = calls[:2]
    assert [np.array_equal(*pair) for pair in zip(first, second, strict=True)] == [True, False, True]


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
    assert np.abs(moved.shortening - np.cos(turn * at)).max() <= of_value
    assert np.abs(moved.active_slope_kpa - turn * np.cos(turn * at)).max() <= of_slope
    assert np.abs(moved.shortening_slope + turn * np.sin(turn * at)).max() <= of_slope
    assert wall.between(np.zeros((3, 20))) is wall
