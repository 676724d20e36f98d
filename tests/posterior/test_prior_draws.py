import numpy as np
import pytest
import torch
from inference_case import PAPER_PRIOR, WIDE_PRIOR
from sbi.utils.sbiutils import mcmc_transform, within_support
from scipy.stats import ks_1samp

from swesbi.networks.torch_prior import torch_prior
from swesbi.prior import PriorSettings, bounds, log_density, quantile

PRIORS = pytest.mark.parametrize("prior", [PAPER_PRIOR, WIDE_PRIOR], ids=["paper", "wide"])


@PRIORS
def test_log_prob_agrees_with_the_prior_of_the_simulations(prior: PriorSettings) -> None:
    rng = np.random.default_rng(1)
    theta = quantile(rng.random((500, 3)), prior)
    ours = torch_prior(prior).log_prob(torch.from_numpy(theta.astype(np.float32)))
    np.testing.assert_allclose(ours, log_density(theta, prior), rtol=2e-5, atol=2e-5)


@PRIORS
def test_icdf_agrees_with_the_prior_of_the_simulations(prior: PriorSettings) -> None:
    u = np.random.default_rng(2).random((500, 3))
    np.testing.assert_allclose(torch_prior(prior).icdf(torch.from_numpy(u)), quantile(u, prior), rtol=1e-6)


def test_samples_follow_the_distribution_and_stay_inside() -> None:
    torch.manual_seed(3)
    sample = torch_prior(PAPER_PRIOR).sample((4000,)).numpy().astype(float)
    low, high = bounds(PAPER_PRIOR)
    assert np.all((sample >= low) & (sample <= high))
    u = np.linspace(0.0, 1.0, 20001)
    table = quantile(np.repeat(u[:, None], 3, axis=1), PAPER_PRIOR)
    for j in range(3):
        distribution = ks_1samp(sample[:, j], lambda x, j=j: np.interp(x, table[:, j], u))
        assert distribution.pvalue > 1e-3, j


def test_moments_are_those_of_the_truncated_distribution() -> None:
    prior = torch_prior(PAPER_PRIOR)
    u = (np.arange(200_000) + 0.5) / 200_000
    theta = quantile(np.repeat(u[:, None], 3, axis=1), PAPER_PRIOR)
    np.testing.assert_allclose(prior.mean, theta.mean(axis=0), rtol=1e-4)
    np.testing.assert_allclose(prior.variance, theta.var(axis=0), rtol=1e-3)


def test_outside_the_bounds_there_is_no_density_and_sbi_sees_it() -> None:
    prior = torch_prior(PAPER_PRIOR)
    theta = torch.tensor([[45.0, 31.0, 30.0], [9.9, 5.0, 30.0], [10.0, 30.0, 60.0], [45.0, -1.0, 30.0]])
    assert torch.isneginf(prior.log_prob(theta)).tolist() == [True, True, False, True]
    assert within_support(prior, theta).tolist() == [False, False, True, False]


def test_sbi_maps_the_box_to_unbounded_space() -> None:
    theta = torch.tensor([[45.0, 5.0, 30.0]])
    transform = mcmc_transform(torch_prior(PAPER_PRIOR))
    torch.testing.assert_close(transform.inv(transform(theta)), theta)
    assert torch.all(transform.inv(torch.full((1, 3), -30.0)) >= torch.tensor([10.0, 2.0, 2.0]) - 1e-3)
