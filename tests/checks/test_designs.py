"""Designs: information with correlated model errors, repeats, phases, and their choice."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import speed_case
from identifiability_case import tiny

from swesbi.checks.identifiability.designs import (
    choose_phases,
    correlation,
    design_information,
    expected_of_designs,
    uniform_phases,
)
from swesbi.checks.identifiability.information import (
    SimulatedStencil,
    SpeedDerivatives,
    derivatives_at,
    expected_sd,
    in_log,
    log_gradient,
    prior_precision,
    simulate_stencil,
)
from swesbi.checks.identifiability.likelihood import (
    differentiate,
    expected_information,
    information_by_datum,
)
from swesbi.checks.identifiability.noise import MeanNoise, single_repeat_noise
from swesbi.checks.identifiability.settings import DesignSettings
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.prior import from_logit, to_logit
from swesbi.recording.speed import NoiseComponents

DISCREPANCY = DiscrepancySettings(speed_fraction=0.03, timing_cycle=0.015)
PRECISION = np.diag([4.0, 3.0, 5.0, 6.0])


@cache
def _simulated() -> SimulatedStencil:
    spread = speed_case.PHI * np.exp(np.random.default_rng(0).normal(0.0, 0.05, (6, 4)))
    return simulate_stencil(speed_case.model(), spread, 0.01)


def test_uncorrelated_errors_give_the_information_of_the_likelihood() -> None:
    model, simulated = speed_case.model(), _simulated()
    own = derivatives_at(model, simulated, model.recording.phase)
    together = correlation(model.recording.phase, 0.05)
    np.testing.assert_allclose(together, np.eye(20), atol=1e-9)
    noise, discrepancy = MeanNoise(speed_case.RELATIVE_SE**2), model.settings.discrepancy
    found = design_information(own, [noise], discrepancy, together[None])[0]
    likelihood = information_by_datum(differentiate(in_log(model), simulated.log_phi[0], 0.01)).sum(axis=1)
    # differences of the slope against differences of the log sd: the same to the second order of the step
    scale = np.sqrt(np.einsum("njj,nkk->njk", likelihood, likelihood))
    np.testing.assert_allclose(found / scale, likelihood / scale, atol=5e-3)


def test_what_sweeps_share_is_in_the_information_of_designs() -> None:
    model, simulated = speed_case.model(), _simulated()
    noise = MeanNoise(speed_case.RELATIVE_SE**2, 0.03**2)
    recording = replace(model.recording, shared=np.full((20, 1), 0.03))
    own = derivatives_at(model, simulated, recording.phase)
    levels = [noise, MeanNoise(noise.own), noise.of(2.0)]
    found = design_information(own, levels, model.settings.discrepancy, np.eye(20)[None])
    moments = in_log(replace(model, recording=recording))
    likelihood = expected_information(differentiate(moments, simulated.log_phi[0], 0.01))
    scale = np.sqrt(np.einsum("njj,nkk->njk", likelihood, likelihood))
    np.testing.assert_allclose(found[0] / scale, likelihood / scale, atol=5e-3)
    one_by_one = [
        design_information(own, [level], model.settings.discrepancy, np.eye(20)[None])[0] for level in levels
    ]
    np.testing.assert_array_equal(found, one_by_one)
    # an error that all speeds share hides their common scale, k_0 and the passive scale together
    diagonal = np.einsum("lnjj->lj", found)
    assert np.all(diagonal[0, [0, 3]] < diagonal[1, [0, 3]]) and np.all(diagonal[0] < diagonal[2])


def test_the_information_of_correlated_errors_is_the_curvature_of_the_divergence() -> None:
    phase = np.array([0.1, 0.12, 0.15, 0.5])
    rng = np.random.default_rng(1)
    slope, by, slope_by = rng.normal(0, 5, 4), rng.normal(0, 1, (2, 4)), rng.normal(0, 3, (2, 4))
    together = correlation(phase, 0.05)

    def covariance(x: np.ndarray) -> np.ndarray:
        s = slope + x @ slope_by
        return together * (0.03**2 + 0.015**2 * np.outer(s, s)) + 0.02**2 * np.eye(4)

    def divergence(x: np.ndarray) -> float:
        """Kullback and Leibler's, from 0 to x; its second derivatives at 0 are the information."""
        at, to, m = covariance(np.zeros(2)), covariance(x), x @ by
        inverse = np.linalg.inv(to)
        logs = np.linalg.slogdet(to)[1] - np.linalg.slogdet(at)[1]
        return float(0.5 * (np.trace(inverse @ at) + m @ inverse @ m - 4.0 + logs))

    h, unit = 1e-3, np.eye(2)
    numeric = np.array(
        [
            [
                sum(a * b * divergence(h * (a * unit[j] + b * unit[k])) for a in (1, -1) for b in (1, -1))
                / (4 * h**2)
                for k in range(2)
            ]
            for j in range(2)
        ]
    )
    at = SpeedDerivatives(phase, slope[None], by[None], slope_by[None])
    found = design_information(at, [MeanNoise(0.02**2)], DISCREPANCY, together[None])[0, 0]
    np.testing.assert_allclose(found, numeric, rtol=1e-3)


def test_the_correlation_is_a_correlation() -> None:
    for count in (7, 20, 45, 60):
        together = correlation(uniform_phases(count), 0.05)
        assert np.linalg.eigvalsh(together).min() > -1e-9
        np.testing.assert_allclose(np.diag(together), 1.0)
    assert correlation(np.array([0.99, 0.01]), 0.05)[0, 1] == pytest.approx(0.6)  # around the cycle


def test_the_variance_of_one_repeat() -> None:
    noise = NoiseComponents(repeat_fraction=0.04, sample_fraction=0.08)
    samples = np.array([[12, 8, 0], [12, 12, 6]])
    expected = 0.04**2 + 0.08**2 * np.mean([1 / 12, 1 / 8, 1 / 12, 1 / 12, 1 / 6])
    found = single_repeat_noise(noise, samples)
    assert (found.own, found.shared) == (pytest.approx(expected), 0.0)
    of_sweeps = single_repeat_noise(replace(noise, sweep_fraction=0.05), samples)
    assert (of_sweeps.own, of_sweeps.shared) == (found.own, pytest.approx(0.05**2))
    assert of_sweeps.of(4.0).total == pytest.approx((expected + 0.05**2) / 4.0)


def test_more_repeats_help_up_to_the_floor_and_more_phases_help() -> None:
    model, settings = speed_case.model(), tiny().design
    many = settings.model_copy(update={"repeats": (1, 3, 12, 1000)})
    found = expected_of_designs(model, _simulated(), MeanNoise(0.05**2), many)
    assert np.all(np.diff(found.sd_log, axis=2) < 0.0)
    assert np.all(found.floor[..., None] < found.sd_log)
    np.testing.assert_allclose(found.sd_log[..., -1], found.floor, rtol=0.02)
    assert np.all(found.sd_log[:, 2] < found.sd_log[:, 0])
    # correlated errors cost information, save what differences of neighbours tell
    ratio = found.sd_log[:, 2, :3] / found.sd_log_independent[:, 2, :3]
    assert ratio.min() > 0.98 and ratio.mean() > 1.03
    np.testing.assert_allclose(found.sd_log[:, :2], found.sd_log_independent[:, :2], rtol=1e-6)
    exact = DiscrepancySettings(speed_fraction=0.0, timing_cycle=0.0)
    perfect = replace(model, settings=model.settings.model_copy(update={"discrepancy": exact}))
    none = expected_of_designs(perfect, _simulated(), MeanNoise(0.05**2), many)
    assert np.all(none.floor < 0.01 * none.sd_log[..., 0])  # without a discrepancy there is no floor


def test_phases_are_chosen_where_the_information_is() -> None:
    phase, dimension = uniform_phases(10), 4
    by = np.zeros((1, dimension, 10))
    by[0, 0, 3], by[0, 1, 7], by[0, 2, 5] = 1.0, 0.8, 0.6
    at = SpeedDerivatives(phase, np.zeros((1, 10)), by, np.zeros_like(by))
    chosen = choose_phases([at], [MeanNoise(0.03**2)], DISCREPANCY, 0.05, PRECISION, (0, 1, 2), 4)
    np.testing.assert_array_equal(chosen[:3], [3, 7, 5])
    assert len(set(chosen)) == 4
    only = choose_phases([at], [MeanNoise(0.03**2)], DISCREPANCY, 0.05, PRECISION, (2,), 1)
    np.testing.assert_array_equal(only, [5])


def test_the_expected_spread_is_near_the_exact_posterior_at_the_shipped_design() -> None:
    """Laplace's approximation misses the tails of theta, a quarter of their spread at most."""
    model = speed_case.model()
    draws = _exact_posterior()
    some = draws[:: len(draws) // 40]
    information = information_by_datum(differentiate(in_log(model), np.log(some), 0.02)).sum(axis=1)
    prior = prior_precision(model.settings.prior)
    expected = expected_sd(prior, information, log_gradient(model, some))[:4]
    ratio = expected / np.log(draws).std(axis=0)
    print("expected over exact posterior sd:", ratio.round(2))
    assert np.all((ratio > 0.72) & (ratio < 1.2))
    np.testing.assert_allclose(ratio[3], 1.0, atol=0.1)


def _exact_posterior() -> np.ndarray:
    """Draws by importance sampling around the truth, in logit, from a proposal three times too wide."""
    model, rng = speed_case.model(), np.random.default_rng(4)
    prior = model.settings.prior
    centre = to_logit(speed_case.PHI[None], prior)[0]
    information = information_by_datum(
        differentiate(lambda eta: in_log(model)(np.log(from_logit(eta, prior))), centre[None], 0.02)
    ).sum(axis=1)[0]
    root = np.linalg.cholesky(3.0 * np.linalg.inv(information + 0.3 * np.eye(4)))
    normal = rng.standard_normal((12_000, 4))
    eta = centre + normal @ root.T
    phi = from_logit(eta, prior)
    low, high = from_logit(np.array([[-800.0] * 4, [800.0] * 4]), prior)
    jacobian = np.log((phi - low) * (high - phi)).sum(axis=1)
    log_weight = model.log_posterior(phi) + jacobian + 0.5 * np.sum(normal**2, axis=1)
    weight = np.exp(log_weight - log_weight.max())
    assert weight.sum() ** 2 / np.sum(weight**2) > 500.0
    return np.asarray(phi[rng.choice(len(phi), 4000, p=weight / weight.sum())])


@pytest.mark.parametrize(
    ("phases", "words"),
    [(21, "placement_phases = 21 of placement_candidates = 20"), (7, "placement_phases = 7 is less than")],
)
def test_a_number_of_chosen_phases_that_cannot_be_compared_is_refused(phases: int, words: str) -> None:
    plain = tiny().design.to_plain() | {"placement_phases": phases}
    with pytest.raises(ValueError, match=words):
        DesignSettings.from_plain(plain)
