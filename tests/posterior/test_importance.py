"""Importance weights against a posterior that is known."""

from __future__ import annotations

import numpy as np
import pytest
from exact_case import (
    PRIOR,
    LogNormal,
    ToyModel,
    check_posterior,
    known_log_evidence,
    proposal,
    weigh,
)

from swesbi.posterior.diagnostics import smooth
from swesbi.posterior.importance import NoLikelihoodError, WeightedDraws, k_hat_limit, resample
from swesbi.prior import log_density

DRAWS = 20_000


def weighted(
    width: float = 1.0, shift: float = 0.0, fraction: float = 0.1, model: ToyModel | None = None
) -> WeightedDraws:
    return weigh(model or ToyModel(), proposal(width, shift), DRAWS, fraction, seed=1)


def log_ratio(draws: WeightedDraws, made_by: LogNormal, fraction: float) -> np.ndarray:
    """The ratios before smoothing, from the formula."""
    prior = np.exp(log_density(draws.phi, PRIOR))
    mixture = (1.0 - fraction) * np.exp(made_by.log_density(draws.phi)) + fraction * prior
    return np.log(prior / mixture) + draws.log_likelihood


@pytest.mark.parametrize(("width", "shift"), [(1.0, 0.0), (1.5, 0.0), (0.8, 0.3), (1.2, -0.7)])
def test_weights_recover_the_known_posterior(width: float, shift: float) -> None:
    draws = weighted(width, shift)
    check_posterior(draws.phi, draws.efficiency * DRAWS, draws.weight)
    assert draws.log_evidence_se < 0.02
    assert draws.log_evidence == pytest.approx(known_log_evidence(), abs=4.0 * draws.log_evidence_se)


def test_weights_of_the_posterior_itself_are_as_efficient_as_its_share_of_the_mixture() -> None:
    draws = weighted(fraction=0.1)
    assert 0.88 < draws.efficiency < 0.92  # draws of the prior hardly count
    assert draws.weight.sum() == pytest.approx(1.0)


def test_weights_are_the_smoothed_ratios() -> None:
    draws = weighted(0.7, 0.5)
    log_weight, k_hat = smooth(log_ratio(draws, proposal(0.7, 0.5), 0.1))
    np.testing.assert_allclose(draws.log_weight, log_weight, atol=1e-9)
    assert draws.k_hat == pytest.approx(k_hat, abs=1e-9)
    assert draws.efficiency == pytest.approx(1.0 / (np.exp(2.0 * log_weight).sum() * DRAWS))


def test_k_hat_rises_as_the_proposal_narrows() -> None:
    k_hat = [weighted(width, fraction=0.001).k_hat for width in (1.2, 0.9, 0.7, 0.4)]
    assert k_hat == sorted(k_hat)
    assert k_hat[0] < 0.3
    assert k_hat[-1] > k_hat_limit(DRAWS)


def test_the_prior_in_the_mixture_bounds_the_weights() -> None:
    fraction, made_by = 0.1, proposal(0.5, 1.0)
    draws = weighted(0.5, 1.0, fraction)
    bound = draws.log_likelihood.max() - np.log(fraction)
    ratios = log_ratio(draws, made_by, fraction)
    assert ratios.max() <= bound
    alone = log_density(draws.phi, PRIOR) + draws.log_likelihood - made_by.log_density(draws.phi)
    assert alone.max() > bound + 5.0


def test_the_share_of_the_prior_is_exact() -> None:
    draws = weighted(fraction=0.25)
    assert draws.from_prior.sum() == DRAWS // 4
    from_prior = np.log(draws.phi[draws.from_prior, 0] / 45.0)
    assert from_prior.std() == pytest.approx(0.4, abs=0.02)


def test_failed_simulations_have_no_weight() -> None:
    limit = 55.0
    draws = weighted(1.3, model=ToyModel(fails_above=limit))
    failed = draws.phi[:, 0] > limit
    assert 0.05 < failed.mean() < 0.95
    assert np.all(draws.weight[failed] == 0.0)
    assert draws.weight.sum() == pytest.approx(1.0)
    assert np.isfinite(draws.log_evidence)
    assert resample(draws, 2000, np.random.default_rng(0))[:, 0].max() <= limit


def test_a_likelihood_that_is_zero_everywhere_is_an_error() -> None:
    with pytest.raises(NoLikelihoodError, match="none of 20000 draws has a likelihood"):
        weighted(model=ToyModel(fails_above=0.0))


def test_resampling_takes_each_row_as_often_as_its_weight_says() -> None:
    draws, count = weighted(1.0, 1.5), 5000
    equal = resample(draws, count, np.random.default_rng(2))
    rows, times = np.unique(equal[:, 0], return_counts=True)
    taken = np.zeros(DRAWS)
    order = np.argsort(draws.phi[:, 0])
    taken[order[np.searchsorted(draws.phi[order, 0], rows)]] = times
    expected = count * draws.weight
    assert taken.sum() == count
    assert np.all(taken >= np.floor(expected - 1e-6))
    assert np.all(taken <= np.ceil(expected + 1e-6))


def test_resampled_draws_come_in_random_order() -> None:
    draws = weighted(1.5)
    equal = resample(draws, 4000, np.random.default_rng(2))
    place = {value: row for row, value in enumerate(draws.phi[:, 0])}
    rows = np.array([place[value] for value in equal[:, 0]])
    assert abs(np.corrcoef(rows, np.arange(4000))[0, 1]) < 0.06
    check_posterior(equal[:2000], 1000)


def test_the_limit_of_k_hat_depends_on_the_number_of_draws() -> None:
    assert k_hat_limit(1000) == pytest.approx(2.0 / 3.0)
    assert k_hat_limit(100) == pytest.approx(0.5)
    assert k_hat_limit(20_000) == 0.7
    assert k_hat_limit(20_000, largest=0.5) == 0.5


@pytest.mark.filterwarnings("error")
def test_one_draw_is_never_reliable_and_its_limit_is_a_number() -> None:
    assert k_hat_limit(1) == k_hat_limit(2) < 0.0
    _, k_hat = smooth(np.zeros(1))
    assert k_hat > k_hat_limit(1)
