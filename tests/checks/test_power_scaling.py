"""Sensitivity of a posterior to the power of its prior and of its likelihood."""

from __future__ import annotations

import arviz
import numpy as np
import pytest
import speed_case
from scipy.stats import norm

from swesbi.checks.identifiability import (
    ALPHA,
    SENSITIVE,
    cumulative_distance,
    parts_of_posterior,
    sensitivity,
)
from swesbi.prior import log_density

PRIOR, DATA = 1.0, 3.0
"""Precisions of a normal prior about zero, and of normal data."""
OBSERVED = 1.5
DRAWS = 40_000


def normal_draws() -> np.ndarray:
    levels = (np.random.default_rng(3).permutation(DRAWS) + 0.5) / DRAWS
    return np.asarray(norm.ppf(levels, DATA * OBSERVED / (PRIOR + DATA), (PRIOR + DATA) ** -0.5))


def log_parts(x: np.ndarray) -> dict[str, np.ndarray]:
    return {"prior": -0.5 * PRIOR * x**2, "data": -0.5 * DATA * (x - OBSERVED) ** 2}


def test_arviz_finds_the_same_sensitivity() -> None:
    rng = np.random.default_rng(5)
    x = rng.multivariate_normal([0.3, -0.2, 0.0], np.array([[1, 0.6, 0], [0.6, 1, 0], [0, 0, 1.0]]), 3000)
    log_term = -0.5 * ((x[:, 0] - 1.0) ** 2 + 0.3 * x[:, 1] ** 4)
    idata = arviz.from_dict(posterior={"x": x[None]}, log_likelihood={"y": log_term[None, :, None]})
    other = arviz.psens(idata, component="likelihood", delta=ALPHA - 1.0)["x"].to_numpy()
    np.testing.assert_allclose(sensitivity(x, log_term).distance, other, rtol=1e-3)


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
    whole = log_density(phi, model.settings.prior) + model.log_likelihood(phi) + np.log(phi).sum(axis=1)
    np.testing.assert_allclose(np.diff(sum(parts.values())), np.diff(whole), atol=1e-8)
    assert np.ptp(parts["nuisances"]) == 0.0 if prior == "paper" else np.ptp(parts["nuisances"]) > 0.0
