"""Fisher information and score, contraction, and which datum informs which parameter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from identifiability_case import (
    LOG_SD_SLOPES,
    NOTHING_SHARED,
    OBSERVED,
    SD,
    SLOPES,
    heteroscedastic,
    linear,
    precision,
)

from swesbi.checks.identifiability.information import (
    contraction,
    expected_sd,
    in_log,
    interval_fold,
    leave_phases_out,
    log_gradient,
    moments_of_phi,
    phase_information,
    prior_precision,
    prior_quantities,
    quantities,
    simulate_stencil,
)
from swesbi.checks.identifiability.likelihood import (
    MomentFunction,
    Moments,
    differentiate,
    expected_information,
    information_by_datum,
    log_likelihood,
    log_likelihood_terms,
    score,
)
from swesbi.measurement.likelihood import SpeedModel, draw_speeds
from swesbi.measurement.settings import DiscrepancySettings

X = np.array([[0.2, -0.1, 0.3]])
SHARED = np.array([[0.3, 0.0], [0.3, 0.2], [0.0, 0.2], [0.3, 0.2], [0.3, 0.0]])


def test_the_information_of_a_linear_normal_model_is_known() -> None:
    found = information_by_datum(differentiate(linear, X, 0.01)).sum(axis=1)[0]
    np.testing.assert_allclose(found, precision(), rtol=1e-9)


def test_the_information_counts_what_the_spread_tells() -> None:
    at = differentiate(heteroscedastic, X, 0.01)
    sd = SD * np.exp(LOG_SD_SLOPES @ X[0])
    expected = SLOPES.T @ np.diag(sd**-2.0) @ SLOPES + 2.0 * LOG_SD_SLOPES.T @ LOG_SD_SLOPES
    np.testing.assert_allclose(information_by_datum(at).sum(axis=1)[0], expected, rtol=1e-8)


def test_the_score_is_the_gradient_of_the_likelihood() -> None:
    at = differentiate(heteroscedastic, X, 0.01)
    step = 1e-6
    numeric = [
        np.diff(
            [log_likelihood_terms(heteroscedastic(X + s * step * unit), OBSERVED).sum() for s in (-1.0, 1.0)]
        )[0]
        / (2.0 * step)
        for unit in np.eye(3)
    ]
    np.testing.assert_allclose(score(at, OBSERVED)[0], numeric, rtol=1e-6)


@pytest.mark.parametrize("shipped", [speed_case.model(), speed_case.model_of_sweeps()], ids=["own", "sweeps"])
def test_the_information_of_speeds_is_the_covariance_of_their_score(shipped: SpeedModel) -> None:
    timing = DiscrepancySettings(speed_fraction=0.01, timing_cycle=0.05)  # a spread that depends much on phi
    draws = 40_000
    model = replace(shipped, settings=shipped.settings.model_copy(update={"discrepancy": timing}))
    phi = np.array([[75.0, 9.0, 24.0, 2.0]])
    at = differentiate(in_log(model), np.log(phi), 0.01)
    predicted = model.predict(phi)
    rng = np.random.default_rng(5)
    repeated = type(predicted)(
        *(np.repeat(part, draws, axis=0) for part in (predicted.log_speed, predicted.slope))
    )
    speeds = draw_speeds(repeated, model.recording.errors, model.settings.discrepancy, rng)
    scores = score(at, np.log(speeds))
    information = expected_information(at)[0]
    scale = np.sqrt(np.diag(information))
    # the Monte Carlo error of a covariance in units of the information is below 1 %, that of a mean 0.5 %
    np.testing.assert_allclose(scores.mean(axis=0) / scale, 0.0, atol=0.02)
    np.testing.assert_allclose(
        np.cov(scores.T) / np.outer(scale, scale), information / np.outer(scale, scale), atol=0.03
    )
    without_spread = (at.mean_by @ at.moments.precision @ np.swapaxes(at.mean_by, 1, 2))[0]
    assert information[2, 2] > 1.1 * without_spread[2, 2]  # so the test would see its omission


def test_the_moments_of_speeds_give_the_likelihood_of_the_speed_model() -> None:
    phi = np.array([[60.0, 6.0, 29.0, 2.2], [90.0, 12.0, 20.0, 1.5]])
    for model in (speed_case.model(), speed_case.model_of_sweeps()):
        found = log_likelihood(moments_of_phi(model, phi), np.log(model.recording.speed_m_s))
        np.testing.assert_allclose(found, model.log_likelihood(phi), rtol=1e-12)
    model = speed_case.model()
    terms = log_likelihood_terms(moments_of_phi(model, phi), np.log(model.recording.speed_m_s))
    np.testing.assert_allclose(terms.sum(axis=1), model.log_likelihood(phi), rtol=1e-12)


def of_sweeps(x: np.ndarray) -> Moments:
    """The heteroscedastic toy, its data sharing two errors."""
    return replace(heteroscedastic(x), shared=SHARED)


def some(data: list[int]) -> MomentFunction:
    """Return the moments of some of the data alone."""

    def moments(x: np.ndarray) -> Moments:
        all_of_them = of_sweeps(x)
        return Moments(all_of_them.mean[:, data], all_of_them.log_sd[:, data], SHARED[data])

    return moments


def test_the_score_of_data_that_share_errors_is_the_gradient_of_their_likelihood() -> None:
    step = 1e-6
    numeric = [
        (
            log_likelihood(of_sweeps(X + step * unit), OBSERVED)
            - log_likelihood(of_sweeps(X - step * unit), OBSERVED)
        )
        / (2.0 * step)
        for unit in np.eye(3)
    ]
    np.testing.assert_allclose(
        score(differentiate(of_sweeps, X, 0.01), OBSERVED)[0], np.ravel(numeric), rtol=1e-6
    )


def test_a_datum_adds_what_the_others_lack() -> None:
    at = differentiate(of_sweeps, X, 0.01)
    whole, added = expected_information(at)[0], information_by_datum(at)[0]
    for i in range(len(OBSERVED)):
        others = [j for j in range(len(OBSERVED)) if j != i]
        without = expected_information(differentiate(some(others), X, 0.01))[0]
        np.testing.assert_allclose(added[i], whole - without, atol=1e-10)
    assert np.abs(added.sum(axis=0) - whole).max() > 0.1  # what is shared, several tell
    nearly = differentiate(lambda x: replace(heteroscedastic(x), shared=np.zeros((5, 1))), X, 0.01)
    alone = differentiate(heteroscedastic, X, 0.01)
    np.testing.assert_allclose(expected_information(nearly), expected_information(alone))
    np.testing.assert_allclose(information_by_datum(nearly), information_by_datum(alone), atol=1e-10)
    np.testing.assert_allclose(score(nearly, OBSERVED), score(alone, OBSERVED))


def test_the_term_of_a_datum_is_its_density_given_the_others() -> None:
    moments = of_sweeps(X)
    found, whole = log_likelihood_terms(moments, OBSERVED)[0], log_likelihood(moments, OBSERVED)[0]
    for i in range(len(OBSERVED)):
        others = [j for j in range(len(OBSERVED)) if j != i]
        without = log_likelihood(some(others)(X), OBSERVED[others])[0]
        assert found[i] == pytest.approx(whole - without)


def test_information_does_not_depend_on_the_step_of_the_differences() -> None:
    model, log_phi = speed_case.model(), np.log(speed_case.PHI[None])
    small, large = (
        information_by_datum(differentiate(in_log(model), log_phi, step)).sum(axis=1)[0]
        for step in (0.005, 0.02)
    )
    scale = np.sqrt(np.outer(np.diag(small), np.diag(small)))
    np.testing.assert_allclose(small / scale, large / scale, atol=0.01)


def test_contraction_of_known_distributions() -> None:
    rng = np.random.default_rng(1)
    prior = np.exp(rng.normal(0.0, [0.5, 0.4], (200_000, 2)))
    same = contraction(prior, prior)
    np.testing.assert_allclose([same.linear, same.logarithm], 0.0, atol=1e-12)
    posterior = np.exp(rng.normal(0.3, [0.05, 0.4], (200_000, 2)))
    np.testing.assert_allclose(contraction(posterior, prior).logarithm, [0.99, 0.0], atol=0.01)


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


def test_leaving_a_datum_out_is_exact_for_a_linear_normal_model() -> None:
    by_datum = information_by_datum(differentiate(linear, X, 0.01))
    prior = np.diag([0.5, 1.0, 2.0])
    found = phase_information(by_datum.sum(axis=1), by_datum, prior, np.eye(3)[None])
    whole = np.sqrt(np.diag(np.linalg.inv(prior + precision())))
    rows = SLOPES / SD[:, None]
    for i in range(len(SD)):
        without = np.linalg.inv(prior + precision() - np.outer(rows[i], rows[i]))
        np.testing.assert_allclose(
            found.sd_increase[:, i], np.sqrt(np.diag(without)) / whole - 1.0, rtol=1e-8
        )
    np.testing.assert_allclose(found.share, (rows**2 / np.sum(rows**2, axis=0)).T, rtol=1e-8)


def test_reweighted_draws_are_those_of_the_posterior_without_the_datum() -> None:
    noise, prior, rng = 3.0 * SD, np.diag([5.0, 4.0, 6.0]), np.random.default_rng(2)
    rows = SLOPES / noise[:, None]
    covariance = np.linalg.inv(prior + rows.T @ rows)
    mean = covariance @ rows.T @ (OBSERVED / noise)
    draws = rng.multivariate_normal(mean, covariance, 20_000)
    log_sd = np.broadcast_to(np.log(noise), (len(draws), len(noise)))
    moments = Moments(draws @ SLOPES.T, log_sd, NOTHING_SHARED)
    found = leave_phases_out(draws, log_likelihood_terms(moments, OBSERVED))
    assert found.k_hat.max() < 0.6
    sd = np.sqrt(np.diag(covariance))
    for i in range(len(noise)):
        without = np.linalg.inv(prior + rows.T @ rows - np.outer(rows[i], rows[i]))
        kept = np.arange(len(noise)) != i
        expected = without @ rows[kept].T @ (OBSERVED[kept] / noise[kept])
        np.testing.assert_allclose(found.sd_increase[:, i], np.sqrt(np.diag(without)) / sd - 1.0, atol=0.03)
        np.testing.assert_allclose(found.mean_shift[:, i], (expected - mean) / sd, atol=0.04)
    assert np.abs(found.sd_increase).max() > 0.1 and np.abs(found.mean_shift).max() > 0.2


def test_expected_sd_of_a_normal_prior_and_of_its_information() -> None:
    prior = prior_precision(speed_case.settings().prior)
    np.testing.assert_allclose(np.diag(prior) ** -0.5, [0.5, 0.6, 0.45, 0.4])
    nothing = expected_sd(prior, np.zeros((1, 4, 4)), np.eye(4)[None])
    np.testing.assert_allclose(nothing, [0.5, 0.6, 0.45, 0.4])
    assert interval_fold(np.array(0.1), 0.9) == pytest.approx(np.exp(2 * 1.6448536 * 0.1))


def test_differences_at_a_bound_of_the_prior_can_be_simulated() -> None:
    """A posterior may press on a bound, and the step of the differences leads beyond it."""
    settings = speed_case.settings("calibrated")
    step = speed_case.shipped().speed_experiments["calibrated"].identifiability.difference_step
    phi = np.array([[parameter.high for parameter in settings.prior.parameters]])
    simulated = simulate_stencil(speed_case.model(prior="calibrated"), phi, step)
    assert len(simulated.beats.status) == 1 + 2 * phi.shape[1]
