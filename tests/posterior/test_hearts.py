"""The likelihood of a heart alone, against quadrature and against the joint likelihood."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import speed_case
from scipy.special import logsumexp

from swesbi.posterior import marginal
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.marginal import row_numbers, uniform
from swesbi.posterior.space import normal_scores, of_scores
from swesbi.prior import sample

NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(13)
OF_FOUR = np.array(list(product(NODES, repeat=4)))
LOG_WEIGHT = np.log(np.array(list(product(WEIGHTS / WEIGHTS.sum(), repeat=4)))).sum(axis=1)


def heart_model() -> HeartModel:
    return HeartModel(speed_case.model(prior="calibrated"))


def hearts(n: int, seed: int = 1) -> np.ndarray:
    """Hearts near the one that was recorded, of any physiology within a third of the prior's width."""
    prior, rng = heart_model().settings.prior, np.random.default_rng(seed)
    near = of_scores(0.33 * rng.standard_normal((n, len(prior.parameters))), prior)
    near[:, :3] = speed_case.PHI[:3] * np.exp(0.1 * rng.standard_normal((n, 3)))
    return near


def quadrature(model: HeartModel, heart: np.ndarray) -> tuple[float, np.ndarray]:
    """Return log p(speeds | heart) and the posterior mean of the four scores, by Gauss-Hermite rules."""
    wall, _ = model.simulated(heart[None])
    about = model.conditional(heart[None], wall)
    scores = about.mode + OF_FOUR @ about.root[0].T
    log_det = np.log(np.diag(about.root[0])).sum()
    log_normal = -0.5 * (OF_FOUR**2 + np.log(2.0 * np.pi)).sum(axis=1) - log_det
    log_prior = -0.5 * (scores**2 + np.log(2.0 * np.pi)).sum(axis=1)
    rows = np.repeat(heart[None], len(scores), axis=0)
    walls = wall.rows(np.zeros(len(scores), np.int64))
    log_ratio = model.log_likelihood_of(rows, walls, scores) + log_prior - log_normal + LOG_WEIGHT
    total = logsumexp(log_ratio)
    return float(total), np.exp(log_ratio - total) @ scores


@pytest.fixture
def many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(marginal, "DRAWS", 2000)


@pytest.mark.usefixtures("many")
def test_the_mean_over_draws_is_the_integral() -> None:
    model, some = heart_model(), hearts(6)
    exact = [quadrature(model, heart)[0] for heart in some]
    np.testing.assert_allclose(model.log_likelihood(some), exact, atol=0.08)


def test_few_draws_are_right_on_average_and_close_to_the_integral() -> None:
    """The estimates at slightly different hearts, over the integrals there, have a mean of one."""
    model, heart = heart_model(), hearts(1, seed=4)
    near = heart * np.exp(1e-7 * np.random.default_rng(2).standard_normal((600, heart.shape[1])))
    ratio = np.exp(model.log_likelihood(near) - quadrature(model, heart[0])[0])
    assert ratio.std() < 0.6
    assert abs(ratio.mean() - 1.0) < 4.0 * ratio.std() / np.sqrt(len(ratio))


def test_the_four_have_their_posterior_where_hearts_are_weighted() -> None:
    model, heart = heart_model(), hearts(1, seed=5)
    near = heart * np.exp(1e-7 * np.random.default_rng(3).standard_normal((800, heart.shape[1])))
    phi = model.evaluated(near).phi
    prior = model.prior
    of_four = [i for i, name in enumerate(prior.names) if name not in prior.simulated.names]
    scores = normal_scores(phi, prior)[:, of_four]
    expected = quadrature(model, heart[0])[1]
    weight = np.exp(model.log_likelihood(near) - model.log_likelihood(near).max())
    weight /= weight.sum()
    error = scores.std(axis=0) * np.sqrt((weight**2).sum())
    assert (np.abs(weight @ scores - expected) < 4.0 * error).all()
    np.testing.assert_array_equal(np.delete(phi, of_four, axis=1), near)


def test_a_heart_s_likelihood_depends_on_its_own_numbers_alone() -> None:
    model, some = heart_model(), hearts(40)
    together = model.log_likelihood(some)
    np.testing.assert_array_equal(model.log_likelihood(some[::-1]), together[::-1])
    np.testing.assert_array_equal(model.log_likelihood(some[7:8]), together[7:8])


def test_numbers_of_rows_are_uniform_and_independent() -> None:
    numbers = row_numbers(hearts(500), 0)
    drawn = np.hstack([uniform(numbers, draw, 5) for draw in range(4)])
    assert np.unique(numbers).size == 500
    assert drawn.min() > 0.0 and drawn.max() < 1.0
    assert np.abs(np.corrcoef(drawn.T) - np.eye(20)).max() < 0.2
    assert np.abs(drawn.mean(axis=0) - 0.5).max() < 0.06


def estimates(model: HeartModel, heart: np.ndarray, n: int = 300) -> np.ndarray:
    """Log estimates of the likelihood of one heart, by different draws."""
    near = heart * np.exp(1e-7 * np.random.default_rng(9).standard_normal((n, len(heart))))
    return model.log_likelihood(near)


def test_a_wall_that_presses_on_the_bound_of_its_prior_has_close_estimates() -> None:
    """Scores follow a truncated prior, and a search that forgets this ends several widths off."""
    made = speed_case.model(prior="calibrated")
    prior = made.settings.prior
    phi = speed_case.central_phi(made)[None]
    phi[0, prior.names.index("passive_ratio")] = 0.9 * prior.theta.nuisances.passive_ratio.high
    errors = replace(made.recording, relative_se=0.01 * np.ones(made.recording.phase.size))
    recording = replace(errors, speed_m_s=np.exp(made.predict(phi).log_speed[0]))
    model = HeartModel(replace(made, recording=recording))
    assert estimates(model, model.points(phi)[0]).std() < 0.6


def test_pushes_of_one_cell_and_unknown_errors_have_close_estimates() -> None:
    """Twelve pushes share what the model misses in four cells, and all errors are thrice what is declared."""
    made = speed_case.model(prior="calibrated")
    phi = speed_case.central_phi(made)[None]
    phase = (np.arange(12) // 3 * 5 + 0.5 + 0.3 * (np.arange(12) % 3 - 1)) / 20.0
    recording = replace(
        made.recording,
        phase=phase,
        speed_m_s=np.ones(12),
        relative_se=np.full(12, 0.05),
        shared=np.empty((12, 0)),
    )
    noiseless = replace(made, recording=recording).predict(phi).log_speed[0]
    noise = 0.15 * np.random.default_rng(4).standard_normal(12)
    declared = {"cell": np.arange(12) // 3 * 5, "errors_log_sd": 0.5}
    pushes = replace(recording, speed_m_s=np.exp(noiseless + noise), **declared)
    model = HeartModel(replace(made, recording=pushes))
    assert estimates(model, model.points(phi)[0]).std() < 0.6


def test_what_is_fixed_is_not_integrated() -> None:
    """With the passive stiffness alone, one number is integrated out."""
    model = speed_case.model()
    alone = HeartModel(model)
    theta = sample(5, alone.settings.prior, np.random.default_rng(6))
    assert theta.shape == (5, 3)
    assert alone.evaluated(theta).phi.shape == (5, 4)
    assert np.isfinite(replace(alone).log_likelihood(theta)).all()
