"""Sensitivity of a posterior to the power of its prior and of its likelihood."""

from __future__ import annotations

import arviz
import numpy as np
import pytest
import speed_case
from scipy.integrate import quad
from scipy.special import rel_entr
from scipy.stats import norm

from swesbi.checks.identifiability.power_scaling import (
    ALPHA,
    SENSITIVE,
    cumulative_distance,
    parts_of_posterior,
    sensitivity,
)
from swesbi.posterior.diagnostics import smooth

PRIOR, DATA = 1.0, 3.0
"""Precisions of a normal prior about zero, and of normal data."""
OBSERVED = 1.5
DRAWS = 40_000


def posterior(prior: float = PRIOR, data: float = DATA) -> tuple[float, float]:
    """Mean and sd of the posterior by these precisions."""
    return data * OBSERVED / (prior + data), (prior + data) ** -0.5


def normal_draws() -> np.ndarray:
    mean, sd = posterior()
    levels = (np.random.default_rng(3).permutation(DRAWS) + 0.5) / DRAWS
    return np.asarray(norm.ppf(levels, mean, sd))


def log_parts(x: np.ndarray) -> dict[str, np.ndarray]:
    return {"prior": -0.5 * PRIOR * x**2, "data": -0.5 * DATA * (x - OBSERVED) ** 2}


def scaled(part: str, alpha: float) -> tuple[float, float]:
    return posterior(**{part: alpha * {"prior": PRIOR, "data": DATA}[part]})


@pytest.mark.parametrize("part", ["prior", "data"])
@pytest.mark.parametrize("alpha", [ALPHA, 1.0 / ALPHA])
def test_weights_give_the_posterior_of_the_scaled_part(part: str, alpha: float) -> None:
    x = normal_draws()
    weight = np.exp(smooth((alpha - 1.0) * log_parts(x)[part])[0])
    mean, sd = scaled(part, alpha)
    assert weight @ x == pytest.approx(mean, abs=2e-3)
    assert np.sqrt(weight @ (x - weight @ x) ** 2) == pytest.approx(sd, rel=3e-3)


def distance_of_normals(one: tuple[float, float], two: tuple[float, float], low: float, high: float) -> float:
    """The cumulative Jensen-Shannon distance by quadrature, over a range of values."""

    def apart(x: float) -> float:
        p, q = norm.cdf(x, *one), norm.cdf(x, *two)
        return float((rel_entr(p, 0.5 * (p + q)) + rel_entr(q, 0.5 * (p + q))) / np.log(2.0))

    whole = quad(lambda x: norm.cdf(x, *one) + norm.cdf(x, *two), low, high)[0]
    return float(np.sqrt(quad(apart, low, high)[0] / whole))


@pytest.mark.parametrize("part", ["prior", "data"])
def test_the_sensitivity_of_a_normal_model_is_known(part: str) -> None:
    x = normal_draws()
    mean, sd = posterior()
    ends = float(x.min()), float(x.max())
    expected = 0.0
    for alpha in (ALPHA, 1.0 / ALPHA):
        there = scaled(part, alpha)
        turned = [(-mean, sd), (-there[0], there[1])]
        both = (
            distance_of_normals((mean, sd), there, *ends),
            distance_of_normals(turned[0], turned[1], -ends[1], -ends[0]),
        )
        expected += max(both) / (2.0 * np.log2(ALPHA))
    found = sensitivity(x[:, None], log_parts(x)[part])
    assert found.distance[0] == pytest.approx(expected, rel=0.02)
    assert found.distance[0] > SENSITIVE and found.k_hat < 0.5


def test_arviz_finds_the_same_sensitivity() -> None:
    rng = np.random.default_rng(5)
    x = rng.multivariate_normal([0.3, -0.2, 0.0], np.array([[1, 0.6, 0], [0.6, 1, 0], [0, 0, 1.0]]), 3000)
    log_density = -0.5 * ((x[:, 0] - 1.0) ** 2 + 0.3 * x[:, 1] ** 4)
    idata = arviz.from_dict(posterior={"x": x[None]}, log_likelihood={"y": log_density[None, :, None]})
    other = arviz.psens(idata, component="likelihood", delta=ALPHA - 1.0)["x"].to_numpy()
    np.testing.assert_allclose(sensitivity(x, log_density).distance, other, rtol=1e-3)


def test_a_likelihood_that_ignores_a_parameter_does_not_move_it() -> None:
    """By draws of a model of two parameters, of which the data know the first alone."""
    x = normal_draws()
    ignored = np.random.default_rng(4).normal(0.0, PRIOR**-0.5, DRAWS)
    both = np.column_stack([x, ignored])
    of_data, of_prior = (
        sensitivity(both, part)
        for part in (log_parts(x)["data"], log_parts(x)["prior"] - 0.5 * PRIOR * ignored**2)
    )
    assert of_data.distance[1] < 0.01 < SENSITIVE < of_data.distance[0]
    assert of_prior.distance[1] > SENSITIVE  # its posterior is the prior


def test_the_distance_knows_neither_unit_nor_sign() -> None:
    x, weight = normal_draws()[:500], np.random.default_rng(6).dirichlet(np.ones(500))
    found = cumulative_distance(x, weight)
    assert cumulative_distance(-7.0 * x, weight) == pytest.approx(found)
    assert cumulative_distance(x, np.full(500, 1.0 / 500)) == pytest.approx(0.0, abs=1e-7)
    assert cumulative_distance(np.ones(500), weight) == 0.0


@pytest.mark.parametrize("prior", ["paper", "calibrated"])
def test_the_parts_make_up_the_posterior_of_log_phi(prior: str) -> None:
    model = speed_case.model(prior=prior)
    centre = speed_case.central_phi(model)
    phi = centre * np.exp(np.random.default_rng(7).normal(0.0, 0.05, (6, len(centre))))
    parts = parts_of_posterior(phi, model.settings.prior, model.log_likelihood(phi))
    whole = model.log_posterior(phi) + np.log(phi).sum(axis=1)
    np.testing.assert_allclose(np.diff(sum(parts.values())), np.diff(whole), atol=1e-8)
    assert np.ptp(parts["nuisances"]) == 0.0 if prior == "paper" else np.ptp(parts["nuisances"]) > 0.0
