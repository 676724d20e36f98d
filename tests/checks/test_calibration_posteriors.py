"""Draws of recordings: weights where they serve, the study's own way where not; two recordings as one."""

from __future__ import annotations

from dataclasses import replace

import exact_case
import numpy as np
import pytest
import speed_case

from swesbi.checks.calibration.local import TwoRecordings, classifier_accuracy, variance_given_first
from swesbi.checks.calibration.ranks import (
    central_level,
    level_of_truth,
    prior_variance,
    quantities,
    quantity_names,
)
from swesbi.draws import effective_draws
from swesbi.measurement.likelihood import log_speed_sd
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.settings import asking
from swesbi.prior import draw_prior

PHI = speed_case.PHI[None]
ENOUGH = 100
FIRST = asking(exact_case.SETTINGS, ENOUGH).first_draws


@pytest.mark.parametrize(
    ("width", "shift", "changes", "by_mcmc"),
    [
        (1.2, 0.0, {}, False),
        (0.3, 4.0, {}, False),
        (1.0, 3.0, {}, False),
        (0.3, 12.0, {}, False),
        (0.3, 4.0, {"max_rounds": 0}, True),
    ],
)
def test_draws_of_a_good_network_of_rounds_and_of_mcmc_have_the_known_posterior(
    width: float, shift: float, changes: dict[str, int], by_mcmc: bool
) -> None:
    model, network = exact_case.ToyModel(), exact_case.proposal(width, shift)
    settings = exact_case.SETTINGS.model_copy(update=changes)
    drawn, rounds = weighted_posterior(model, network, ENOUGH, settings, 1)
    assert (drawn is not rounds.weighted) == by_mcmc
    np.testing.assert_allclose(drawn.log_likelihood, model.log_likelihood(drawn.phi))
    effective = 800 if by_mcmc else effective_draws(drawn.weight)
    exact_case.check_posterior(drawn.phi, effective, drawn.weight)
    if by_mcmc:
        assert len(drawn.phi) == settings.draws
    else:
        assert effective >= ENOUGH
        assert (len(drawn.phi) > FIRST) == (shift > 0.0)
        assert drawn.log_evidence == pytest.approx(exact_case.known_log_evidence(), abs=0.2)
        assert effective_draws(drawn.weight[:FIRST] / drawn.weight[:FIRST].sum()) > 3.0


def test_weights_that_are_fewer_than_sought_and_enough_are_not_taken_for_mcmc() -> None:
    settings = exact_case.SETTINGS.model_copy(update={"max_rounds": 0, "min_effective_draws": 50})
    drawn, rounds = weighted_posterior(exact_case.ToyModel(), exact_case.proposal(1.2), 10**6, settings, 1)
    assert drawn is rounds.weighted
    assert 50 < effective_draws(drawn.weight) < len(drawn.phi) == settings.first_draws


@pytest.mark.parametrize("width", [1.0, 1.2])
def test_levels_of_few_effective_draws_are_uniform(width: float) -> None:
    """Truth and draws of a normal posterior, in closed form, the draws weighted from a normal proposal."""
    rng, hearts, draws = np.random.default_rng(6), 6000, 30
    truth, drawn = rng.standard_normal((hearts, 1)), width * rng.standard_normal((hearts, draws))
    weight = np.exp(0.5 * (drawn / width) ** 2 - 0.5 * drawn**2)
    weight /= weight.sum(axis=1, keepdims=True)
    rows = zip(truth, drawn, weight, strict=True)
    level = np.array([level_of_truth(one, values[:, None], share)[0] for one, values, share in rows])
    plain = (weight * (drawn < truth)).sum(axis=1)
    # of a uniform level the mean square of 2 u - 1 is a third, of variance 4 / 45
    error = np.sqrt(4.0 / 45.0 / hearts)
    assert np.mean(central_level(level) ** 2) == pytest.approx(1.0 / 3.0, abs=4.0 * error)
    assert np.mean(central_level(plain) ** 2) > 1.0 / 3.0 + 4.0 * error


def test_two_recordings_have_the_likelihood_of_both() -> None:
    model = speed_case.model()
    second = replace(model.recording, speed_m_s=1.03 * model.recording.speed_m_s)
    both, alone = TwoRecordings.of(model, second.speed_m_s), replace(model, recording=second)
    phi = np.array([[60.0, 6.0, 29.0, 2.2], [50.0, 7.0, 20.0, 2.0]])
    of_each = model.log_likelihood(phi) + alone.log_likelihood(phi)
    np.testing.assert_allclose(both.log_likelihood(phi), of_each)
    np.testing.assert_allclose(both.recording.speed_m_s, np.sqrt(1.03) * model.recording.speed_m_s)


def test_chi_squared_is_that_of_the_residuals() -> None:
    model = speed_case.model()
    predicted = model.predict(PHI)
    sd = log_speed_sd(predicted, model.recording.relative_se, model.settings.discrepancy)
    shifted = replace(model.recording, speed_m_s=model.recording.speed_m_s * np.exp(2.0 * sd[0]))
    moved = replace(model, recording=shifted)
    expected = 4.0 * len(model.recording.phase)
    assert moved.chi_squared(predicted, np.random.default_rng(0)) == pytest.approx([expected])
    np.testing.assert_allclose(moved.likeliest_residuals(predicted), 2.0)


@pytest.mark.parametrize("prior", ["paper", "calibrated"])
def test_variances_of_the_quantities_are_those_of_prior_draws(prior: str) -> None:
    model = speed_case.model(prior=prior)
    joint = model.settings.prior
    phi = draw_prior(joint, 200_000, np.random.default_rng(6))
    drawn = quantities(phi, np.zeros(len(phi)), model.activation_duration_s(phi))
    named = np.array(quantity_names(joint)) != "log_likelihood"
    variance = prior_variance(model)
    np.testing.assert_allclose(variance[named], drawn[:, named].var(axis=0), rtol=0.03)
    assert np.isnan(variance[~named]).all()
    np.testing.assert_allclose(variance_given_first(model, phi)[named], drawn[:, named].var(axis=0))


def test_a_classifier_is_lost_between_equal_samples_only() -> None:
    prior, rng = speed_case.settings().prior, np.random.default_rng(7)
    first, second = draw_prior(prior, 400, rng), draw_prior(prior, 400, rng)
    assert classifier_accuracy(first, second, prior, 1) == pytest.approx(0.5, abs=0.06)
    narrow = second * np.array([1.0, 1.0, 0.6, 1.0])
    assert classifier_accuracy(first, np.maximum(narrow, first.min(axis=0)), prior, 1) > 0.6


def test_draws_that_a_resampling_took_several_times_are_not_recognised() -> None:
    """Of two samples of one distribution, each of 500 draws taken four times; .62 if copies part."""
    prior = speed_case.settings("calibrated").prior
    first, second = (draw_prior(prior, 500, np.random.default_rng(seed)).repeat(4, axis=0) for seed in (1, 2))
    assert classifier_accuracy(first, second, prior, 1) == pytest.approx(0.5, abs=0.06)


def test_a_classifier_needs_equal_numbers_and_says_nothing_without_draws() -> None:
    prior, phi = speed_case.settings().prior, np.tile(speed_case.PHI, (60, 1))
    with pytest.raises(ValueError, match="60 and 40 draws"):
        classifier_accuracy(phi, phi[:40], prior, 1)
    assert np.isnan(classifier_accuracy(phi, np.full_like(phi, np.nan), prior, 1))
