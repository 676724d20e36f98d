"""Expected information of speeds: which phase informs which quantity, and what more repeats would buy."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import speed_case

from swesbi.checks.identifiability import (
    contraction,
    log_correlations,
    log_gradient,
    prior_quantities,
    quantities,
)
from swesbi.checks.information import (
    Expectation,
    MoreRepeats,
    SpeedDerivatives,
    expected_information,
    more_repeats,
    prior_precision,
    simulated_stencil,
    speed_derivatives,
)
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import REPORTED_NAMES
from swesbi.prior import from_logit, log_density, to_logit

TIMING = DiscrepancySettings(speed_fraction=0.02, timing_cycle=0.05)
"""A spread of the data that depends much on phi."""
NONE = DiscrepancySettings(speed_fraction=0.0, timing_cycle=0.0)
PHI = np.array([[75.0, 9.0, 24.0, 2.0]])
STEP = 0.02
"""Of the differences of log phi."""


def of_pushes() -> SpeedModel:
    """Two points of each cell, which share what the model misses."""
    model = speed_case.model()
    return replace(model, recording=replace(model.recording, cell=np.arange(20) // 2))


def moments(model: SpeedModel, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the log speeds, written down element by element."""
    predicted, recording = model.predict(phi[None]), model.recording
    slope = predicted.slope[0]
    covariance = np.diag(recording.relative_se**2) + recording.shared @ recording.shared.T
    for i, one in enumerate(recording.cells):
        for j, other in enumerate(recording.cells):
            if one == other:
                covariance[i, j] += TIMING.speed_fraction**2 + TIMING.timing_cycle**2 * slope[i] * slope[j]
    return predicted.log_speed[0], covariance


@pytest.mark.parametrize(
    "shipped",
    [speed_case.model(), speed_case.model_of_sweeps(), of_pushes()],
    ids=["own errors", "sweeps", "cells"],
)
def test_the_information_is_the_curvature_of_the_divergence(shipped: SpeedModel) -> None:
    """Kullback's and Leibler's divergence, from the data of one phi to those of others near it."""
    model, h, unit = with_errors(shipped, TIMING), 0.01, np.eye(4)
    mean, covariance = moments(model, PHI[0])

    def divergence(step: np.ndarray) -> float:
        there, spread = moments(model, PHI[0] * np.exp(step))
        inverse, away = np.linalg.inv(spread), there - mean
        logs = np.linalg.slogdet(spread)[1] - np.linalg.slogdet(covariance)[1]
        return float(0.5 * (np.trace(inverse @ covariance) + away @ inverse @ away - len(mean) + logs))

    numeric, signs = np.zeros((4, 4)), list(product((1, -1), (1, -1)))
    for j, k in product(range(4), range(4)):
        corners = [a * b * divergence(h * (a * unit[j] + b * unit[k])) for a, b in signs]
        numeric[j, k] = sum(corners) / (4.0 * h**2)
    at = speed_derivatives(model, simulated_stencil(model, PHI, 0.01))
    found = expected_information(at, model.recording, TIMING)[0]
    scale = np.sqrt(np.outer(np.diag(numeric), np.diag(numeric)))
    np.testing.assert_allclose(found / scale, numeric / scale, atol=5e-3)
    of_mean = at.log_speed_by[0] @ np.linalg.inv(covariance) @ at.log_speed_by[0].T
    assert found[2, 2] > 1.05 * of_mean[2, 2]  # so the test would see the spread's omission


def linear(rows: np.ndarray) -> Expectation:
    """What log speeds, linear in log phi with these rows (p, 4), let one expect of the parameters."""
    plain = with_errors(speed_case.model(phases=len(rows)), NONE)
    flat = np.zeros((1, len(rows)))
    return Expectation(plain, SpeedDerivatives(flat, rows.T[None], 0.0 * rows.T[None]), np.eye(4)[None])


def test_the_expected_posterior_of_a_linear_normal_model_is_exact() -> None:
    rows = np.random.default_rng(0).normal(0.0, 0.2, (6, 4))
    expected = linear(rows)
    prior, scaled = prior_precision(expected.model.settings.prior), rows / speed_case.RELATIVE_SE

    def sd(kept: np.ndarray) -> np.ndarray:
        return np.sqrt(np.diag(np.linalg.inv(prior + scaled[kept].T @ scaled[kept])))

    everything = np.ones(6, dtype=bool)
    np.testing.assert_allclose(expected.sd(expected.model.recording), sd(everything))
    found = expected.by_phase()
    for i in range(6):
        without = sd(np.arange(6) != i) / sd(everything) - 1.0
        np.testing.assert_allclose(found.sd_increase[:, i], without, rtol=1e-6)
    np.testing.assert_allclose(found.share, (rows**2 / np.sum(rows**2, axis=0)).T)


def test_a_parameter_that_the_speeds_ignore_keeps_its_prior() -> None:
    rows = np.random.default_rng(1).normal(0.0, 0.2, (6, 4)) * [1.0, 0.0, 1.0, 1.0]
    expected = linear(rows)
    assert expected.sd(expected.model.recording)[1] == pytest.approx(0.6)
    with np.errstate(invalid="ignore"):  # shares of nothing
        assert expected.by_phase().sd_increase[1] == pytest.approx(0.0, abs=1e-12)
    draws = speed_case.PHI * np.exp(np.random.default_rng(2).normal(0.0, 0.6, (100_000, 4)))
    narrowed = np.where([True, False, True, True], draws**0.1, draws)
    assert contraction(np.log(narrowed), np.log(draws)) == pytest.approx([0.99, 0.0, 0.99, 0.99])
    assert contraction(narrowed, draws)[1] == pytest.approx(0.0)


def test_draws_whose_neighbours_have_no_beat_are_left_out() -> None:
    model = speed_case.model()
    phi = np.vstack([speed_case.PHI, 1.1 * speed_case.PHI])
    gradient = log_gradient(model, phi)
    gradient[0, 0, 0] = np.nan
    simulated = simulated_stencil(model, phi, STEP)
    found = Expectation.of(model, simulated, gradient).sd(model.recording)
    alone = Expectation.of(model, simulated_stencil(model, phi[1:], STEP), gradient[1:]).sd(model.recording)
    np.testing.assert_allclose(found, alone)


def test_information_does_not_depend_on_the_step_of_the_differences() -> None:
    model = with_errors(speed_case.model(), TIMING)
    small, large = (
        expected_information(
            speed_derivatives(model, simulated_stencil(model, PHI, step)), model.recording, TIMING
        )[0]
        for step in (0.005, 0.02)
    )
    scale = np.sqrt(np.outer(np.diag(small), np.diag(small)))
    np.testing.assert_allclose(small / scale, large / scale, atol=0.01)


def test_correlations_are_those_of_the_logarithms() -> None:
    covariance = np.array([[1.0, -0.8], [-0.8, 1.0]])
    phi = np.exp(np.random.default_rng(2).multivariate_normal([0.0, 1.0], covariance, 200_000))
    np.testing.assert_allclose(log_correlations(phi, phi), covariance, atol=0.01)
    np.testing.assert_allclose(log_correlations(phi[:, :1], 5.0 * phi**2), [[1.0, -0.8]], atol=0.01)


def test_prior_quantities_have_the_priors_moments() -> None:
    model = speed_case.model()
    prior, duration_s = model.settings.prior, model.activation_duration_s(speed_case.PHI[None])
    values = np.log(prior_quantities(model))
    inside = [part.log_sd for part in prior.parameters]
    # truncation narrows the normal: least for k_0, whose bounds lie three standard deviations away
    assert np.all(values[:, :4].std(axis=0) < inside)
    assert values[:, 0].std() == pytest.approx(inside[0], rel=0.02)
    np.testing.assert_allclose(
        np.exp(values[:, 4]), np.exp(values[:, 0]) * -np.expm1(-np.exp(values[:, 1]) * duration_s)
    )


def test_the_gradient_of_the_quantities() -> None:
    model, step = speed_case.model(prior="calibrated"), 1e-6
    phi = speed_case.central_phi(model)[None]
    for j, direction in enumerate(np.eye(phi.shape[1])):
        up, down = (quantities(model, phi * np.exp(s * step * direction)) for s in (1.0, -1.0))
        numeric = np.log(up / down)[0] / (2.0 * step)
        np.testing.assert_allclose(log_gradient(model, phi)[0, :, j], numeric, atol=1e-6)


def test_differences_at_a_bound_of_the_prior_can_be_simulated() -> None:
    """A posterior may press on a bound, and the step of the differences leads beyond it."""
    settings = speed_case.settings("calibrated")
    step = speed_case.shipped().speed_experiments["calibrated"].identifiability.difference_step
    phi = np.array([[parameter.high for parameter in settings.prior.parameters]])
    simulated = simulated_stencil(speed_case.model(prior="calibrated"), phi, step)
    assert len(simulated.beats.status) == 1 + 2 * phi.shape[1]


def test_the_expected_spread_is_near_the_exact_posterior() -> None:
    """Laplace's approximation misses the tails of theta, a quarter of their spread at most."""
    model, draws = speed_case.model(), exact_posterior()
    some = draws[:: len(draws) // 40]
    expected = Expectation.of(model, simulated_stencil(model, some, 0.02), log_gradient(model, some))
    ratio = expected.sd(model.recording)[:4] / np.log(draws).std(axis=0)
    assert np.all((ratio > 0.72) & (ratio < 1.2))
    np.testing.assert_allclose(ratio[3], 1.0, atol=0.1)


def exact_posterior() -> np.ndarray:
    """Draws by importance sampling around the truth, in logit, from a proposal three times too wide."""
    model, rng = speed_case.model(), np.random.default_rng(4)
    prior, discrepancy = model.settings.prior, model.settings.discrepancy
    low, high = from_logit(np.array([[-800.0] * 4, [800.0] * 4]), prior)
    at = speed_derivatives(model, simulated_stencil(model, speed_case.PHI[None], 0.02))
    per_logit = (speed_case.PHI - low) * (high - speed_case.PHI) / ((high - low) * speed_case.PHI)
    information = expected_information(at, model.recording, discrepancy)[0] * np.outer(per_logit, per_logit)
    root = np.linalg.cholesky(3.0 * np.linalg.inv(information + 0.3 * np.eye(4)))
    normal = rng.standard_normal((12_000, 4))
    phi = from_logit(to_logit(speed_case.PHI[None], prior)[0] + normal @ root.T, prior)
    jacobian = np.log((phi - low) * (high - phi)).sum(axis=1)
    log_target = log_density(phi, prior) + model.log_likelihood(phi) + jacobian
    log_weight = log_target + 0.5 * np.sum(normal**2, axis=1)
    weight = np.exp(log_weight - log_weight.max())
    assert weight.sum() ** 2 / np.sum(weight**2) > 500.0
    return np.asarray(phi[rng.choice(len(phi), 4000, p=weight / weight.sum())])


def repeats(model: SpeedModel) -> MoreRepeats:
    found = more_repeats(model, np.tile(speed_case.PHI, (2, 1)), STEP)
    assert found is not None
    return found


def with_errors(model: SpeedModel, discrepancy: DiscrepancySettings, **changes: object) -> SpeedModel:
    """Return the model with this discrepancy and its recording changed so."""
    settings = model.settings.model_copy(update={"discrepancy": discrepancy})
    return replace(model, recording=replace(model.recording, **changes), settings=settings)


@pytest.mark.parametrize("shared", [0.0, 1e-3])
def test_without_errors_of_the_model_intervals_narrow_as_the_root_of_the_repeats(shared: float) -> None:
    errors = {"relative_se": np.full(20, 1e-4), "shared": np.full((20, 1), shared)}
    found = repeats(with_errors(speed_case.model(), NONE, **errors))
    of_stiffness = found.width[:, REPORTED_NAMES.index("passive_stiffness_kpa")]
    assert of_stiffness == pytest.approx(np.array(found.times) ** -0.5, rel=0.02)


def test_errors_of_the_model_are_not_averaged_away() -> None:
    missed = DiscrepancySettings(speed_fraction=0.1, timing_cycle=0.0)
    exact = with_errors(speed_case.model(), missed, relative_se=np.full(20, 1e-3))
    assert (repeats(exact).width > 0.999).all()
    width = repeats(speed_case.model()).width
    assert (width[0] < 1.0).all() and (np.diff(width, axis=0) < 0.0).all()
    assert (width > np.array([2.0, 4.0, 8.0])[:, None] ** -0.5).all()


def test_pushes_of_one_instant_count_as_their_mean() -> None:
    """Three pushes of a cell with errors sqrt(3) as large tell what one tells, now and with more of them."""
    shipped = speed_case.model()
    plain = replace(shipped, recording=replace(shipped.recording, relative_se=np.full(20, 0.05)))
    thrice = replace(
        plain.recording,
        phase=np.repeat(plain.recording.phase, 3),
        speed_m_s=np.repeat(plain.recording.speed_m_s, 3),
        relative_se=np.full(60, 0.05 * np.sqrt(3.0)),
        shared=np.empty((60, 0)),
        cell=np.repeat(np.arange(20), 3),
    )
    pushes = repeats(replace(plain, recording=thrice))
    np.testing.assert_allclose(pushes.width, repeats(plain).width, rtol=0.01)
    apart = repeats(replace(plain, recording=replace(thrice, cell=np.arange(60))))
    assert (apart.width < pushes.width - 0.005).any()
