"""Mixtures of Student distributions: their density, and what they are worth of a posterior with two modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal, multivariate_t

from swesbi.posterior.fitted import StudentMixture, StudentProposal, fitted_proposal

FloatArray = NDArray[np.float64]
APART = np.array([3.0, 3.0, 0.0])


def two_modes(x: FloatArray) -> FloatArray:
    """Return the log density of two normals, one with three times the mass; shape (n,)."""
    first, second = (multivariate_normal(centre, 0.25 * np.eye(3)) for centre in (-APART, APART))
    return np.asarray(np.logaddexp(np.log(0.75) + first.logpdf(x), np.log(0.25) + second.logpdf(x)))


def weighted(count: int) -> tuple[FloatArray, FloatArray]:
    """Return draws of a wide normal and their log weights under the two modes."""
    wide = multivariate_normal(np.zeros(3), 9.0 * np.eye(3))
    x = wide.rvs(count, random_state=np.random.default_rng(1))
    return x, two_modes(x) - wide.logpdf(x)


def efficiency(proposal: StudentMixture | StudentProposal) -> float:
    x = proposal.draw(4000, np.random.default_rng(2))
    weight = np.exp(two_modes(x) - proposal.log_density(x))
    return float(weight.sum() ** 2 / (weight**2).sum() / len(x))


@pytest.mark.parametrize("d", [1, 14])
def test_one_distribution_is_that_of_scipy_to_the_byte(d: int) -> None:
    rng = np.random.default_rng(3)
    mean, root = rng.normal(size=d), rng.normal(size=(d, d))
    scale, x = root @ root.T + 0.1 * np.eye(d), rng.normal(size=(50, d))
    ours, theirs = StudentProposal(mean, scale), multivariate_t(mean, scale, df=8)
    np.testing.assert_array_equal(ours.log_density(x), theirs.logpdf(x))
    drawn = ours.draw(50, np.random.default_rng(4))
    np.testing.assert_array_equal(drawn, theirs.rvs(50, np.random.default_rng(4)).reshape(50, d))


def test_a_mixture_follows_two_modes_with_their_shares() -> None:
    x, log_weight = weighted(60_000)
    mixture = fitted_proposal(x, log_weight)
    share = sum(s for s, part in zip(mixture.share, mixture.parts, strict=True) if part.mean[0] > 0.0)
    assert share == pytest.approx(0.25, abs=0.05)
    normal = np.exp(log_weight - log_weight.max())
    mean = normal @ x / normal.sum()
    covariance = (x - mean).T @ ((x - mean) * normal[:, None]) / normal.sum()
    assert efficiency(mixture) > 0.7 > 2.0 * efficiency(StudentProposal(mean, covariance))


def test_draws_have_the_density_of_their_mixture() -> None:
    mixture = fitted_proposal(*weighted(60_000))
    wide = StudentProposal(np.zeros(3), 9.0 * np.eye(3))
    x = wide.draw(200_000, np.random.default_rng(3))
    ratio = np.exp(mixture.log_density(x) - wide.log_density(x))
    drawn = mixture.draw(50_000, np.random.default_rng(4))
    assert ratio.mean() == pytest.approx(1.0, abs=5.0 * ratio.std() / np.sqrt(len(x)))
    above = np.average(x[:, 0] > 0.0, weights=ratio)
    assert (drawn[:, 0] > 0.0).mean() == pytest.approx(above, abs=0.02)


@pytest.mark.parametrize("dimension", [1, 3])
def test_one_point_has_the_density_that_it_has_among_others(dimension: int) -> None:
    wide = StudentProposal(np.zeros(dimension), 2.0 * np.eye(dimension))
    mixture = StudentMixture(np.array([0.5, 0.5]), (wide, replace(wide, mean=np.ones(dimension))))
    x = np.random.default_rng(7).standard_normal((4, dimension))
    for proposal in (wide, mixture):
        alone = [proposal.log_density(x[row : row + 1]) for row in range(4)]
        np.testing.assert_allclose(np.concatenate(alone), proposal.log_density(x), rtol=1e-12)
        assert proposal.log_density(x[:0]).shape == (0,)


def test_few_effective_draws_get_one_wide_part() -> None:
    x = np.random.default_rng(5).standard_normal((500, 4))
    (part,) = fitted_proposal(x, -200.0 * (x**2).sum(axis=1)).parts
    assert np.linalg.eigvalsh(part.scale).min() > 0.02


def test_a_fit_does_not_depend_on_the_order_of_draws_but_for_rounding() -> None:
    x, log_weight = weighted(40_000)
    order = np.random.default_rng(6).permutation(len(x))
    one, other = fitted_proposal(x, log_weight), fitted_proposal(x[order], log_weight[order])
    np.testing.assert_allclose(one.log_density(x[:100]), other.log_density(x[:100]), rtol=1e-9)
