"""Visits of one person: the prior that ties them, the likelihood of all recordings and of both hearts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import speed_case
from scipy.linalg import block_diag
from scipy.special import logsumexp
from scipy.stats import kstest, multivariate_normal, multivariate_t, norm

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel, log_speed_sd
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.persons.change.visits import Coupling, VisitsModel, visits_model
from swesbi.posterior.marginal import Marginal
from swesbi.posterior.space import ScoreSpace, normal_scores, of_scores
from swesbi.prior import draw_prior, in_bounds, log_density, sample

TIED = ("passive_ratio", "destruction_alpha", "speed_scale")
SHARED = {"passive_stiffness_kpa": 0.5, "passive_ratio": 0.7, "speed_scale": 0.9, "destruction_alpha": 0.8}
INDEX = (np.delete(np.arange(20), [3]), np.delete(np.arange(20), [0, 9, 15]))
DRAWS = 3000
ESTIMATES = 1000


PRIOR = speed_case.settings("calibrated").prior


def coupled(share: float, visits: int = 2) -> Coupling:
    return Coupling(PRIOR, np.array([share if name in TIED else 0.0 for name in PRIOR.names]), visits)


def test_visits_that_share_nothing_are_independent_to_the_bit() -> None:
    coupling = coupled(0.0)
    psi = sample(50, coupling.joint, np.random.default_rng(1))
    np.testing.assert_array_equal(np.hstack(list(coupling.phi(psi))), psi)


def test_each_visit_keeps_its_prior_and_scores_are_correlated_by_the_share() -> None:
    coupling = coupled(0.8, 3)
    psi = sample(4000, coupling.joint, np.random.default_rng(1))
    phi = coupling.phi(psi)
    np.testing.assert_allclose(coupling.psi(phi), psi, rtol=1e-6)
    scores = np.stack([normal_scores(each, PRIOR) for each in phi])
    for visit in scores:
        for column in visit.T:
            assert kstest(column, norm.cdf).pvalue > 1e-4
    for j, name in enumerate(PRIOR.names):
        correlation = np.asarray(np.corrcoef(scores[:, :, j]))[np.triu_indices(3, 1)]
        np.testing.assert_allclose(correlation, 0.8 if name in TIED else 0.0, atol=0.06)


def recorded(made: SpeedModel, faster: float) -> tuple[SpeedModel, ...]:
    """Return recordings in sweeps, each without phases of its own; the later is at another heart rate."""
    plain, sweeps = made.recording, speed_case.model_of_sweeps().recording
    recordings = [
        replace(
            plain,
            context=replace(plain.context, hr_bpm=66.0 + 4.0 * visit),
            phase=plain.phase[index],
            speed_m_s=plain.speed_m_s[index] * (1.0 + faster * visit),
            relative_se=sweeps.relative_se[index],
            shared=sweeps.shared[index],
        )
        for visit, index in enumerate(INDEX)
    ]
    return tuple(replace(made, recording=each) for each in recordings)


def visits(share: float, timing_cycle: float) -> VisitsModel:
    plain = speed_case.model()
    discrepancy = DiscrepancySettings(speed_fraction=0.02, timing_cycle=timing_cycle)
    made = replace(plain, settings=plain.settings.model_copy(update={"discrepancy": discrepancy}))
    return visits_model(recorded(made, 0.01), INDEX, np.zeros(4), share)


def in_whole(model: VisitsModel, psi: FloatArray) -> FloatArray:
    """Return log p(both recordings | psi) of psi (n, 2 d), each simulated and measured in whole."""
    walls = [one.wall(phi) for one, phi in zip(model.models, model.coupling.phi(psi), strict=True)]
    return model.log_density_about(model.predicted(psi, walls))


@pytest.mark.parametrize(("share", "timing_cycle"), [(0.0, 0.01), (0.6, 0.0), (0.6, 0.01)])
def test_the_shared_discrepancy_is_a_covariance_at_equal_phases(share: float, timing_cycle: float) -> None:
    model = visits(share, timing_cycle)
    psi = sample(6, model.prior, np.random.default_rng(3))
    predicted = [one.predict(phi) for one, phi in zip(model.models, model.coupling.phi(psi), strict=True)]
    recordings = [one.recording for one in model.models]
    discrepancy = model.models[0].settings.discrepancy
    cross = share * 0.02**2 * (INDEX[0][:, None] == INDEX[1])
    found = in_whole(model, psi)
    for row in range(len(psi)):
        own = [
            np.diag(log_speed_sd(each, recording.relative_se, discrepancy)[row] ** 2)
            + recording.shared @ recording.shared.T
            for each, recording in zip(predicted, recordings, strict=True)
        ]
        covariance = block_diag(*own)
        covariance[: len(cross), len(cross) :], covariance[len(cross) :, : len(cross)] = cross, cross.T
        mean = np.concatenate([each.log_speed[row] for each in predicted])
        observed = np.log(np.concatenate([recording.speed_m_s for recording in recordings]))
        assert found[row] == pytest.approx(multivariate_normal(mean, covariance).logpdf(observed), rel=1e-9)


def test_scores_and_their_slope_are_those_of_the_prior() -> None:
    space = ScoreSpace(coupled(0.5).joint)
    psi = draw_prior(space.prior, 40, np.random.default_rng(4))
    u, log_slope = space.place(psi)
    np.testing.assert_allclose(space.at(u), psi, rtol=1e-9)
    np.testing.assert_allclose(norm.logpdf(u).sum(axis=1) + log_slope, log_density(psi, space.prior))
    assert in_bounds(space.at(np.full((1, u.shape[1]), 50.0)), space.prior).all()


@cache
def models() -> tuple[SpeedModel, ...]:
    return recorded(speed_case.model(prior="calibrated"), 0.04)


def both(shares: Mapping[str, float], discrepancy_share: float) -> VisitsModel:
    of_names = np.array([shares.get(name, 0.0) for name in PRIOR.names])
    return visits_model(models(), INDEX, of_names, discrepancy_share)


def hearts(n: int, seed: int) -> FloatArray:
    """Psi (n, 2 k) of hearts near the one that was recorded."""
    prior, rng = PRIOR.simulated, np.random.default_rng(seed)

    def of_visit() -> FloatArray:
        near = of_scores(0.3 * rng.standard_normal((n, len(prior.parameters))), prior)
        near[:, :3] = speed_case.PHI[:3] * np.exp(0.1 * rng.standard_normal((n, 3)))
        return near

    return np.hstack([of_visit(), of_visit()])


def long_average(model: VisitsModel, heart: FloatArray) -> tuple[float, float]:
    """Return log p(both recordings | heart), of psi (2 k,), and its error, by weighted draws of the scores.

    Each has its own psi of all parameters, which is simulated and measured in whole.
    """
    walls, _ = model.simulated(heart[None])
    about = model.conditional(heart[None], walls)
    wide = multivariate_t(about.mode[0], about.root[0] @ about.root[0].T, df=8, seed=5)
    scores = wide.rvs(DRAWS)
    psi = np.empty((DRAWS, model.coupling.visits, len(PRIOR.names)))
    measures = [j for j, name in enumerate(PRIOR.names) if name not in PRIOR.simulated.names]
    others = [j for j in range(len(PRIOR.names)) if j not in measures]
    by_visit = scores.reshape(DRAWS, model.coupling.visits, -1)
    for visit, own in enumerate(np.split(heart, model.coupling.visits)):
        psi[:, visit, others] = own
        psi[:, visit, measures] = of_scores(by_visit[:, visit], PRIOR.operator)
    log_likelihood = in_whole(model, psi.reshape(DRAWS, -1))
    log_ratio = log_likelihood + norm.logpdf(scores).sum(axis=1) - wide.logpdf(scores)
    weight = np.exp(log_ratio - logsumexp(log_ratio))
    return float(logsumexp(log_ratio) - np.log(DRAWS)), float(np.sqrt((weight**2).sum() - 1.0 / DRAWS))


def averaged(model: Marginal[Any], heart: FloatArray) -> tuple[float, float]:
    """Return the log of the mean estimate of hearts that hardly differ from one, (k,), and its error."""
    near = heart * np.exp(1e-7 * np.random.default_rng(4).standard_normal((ESTIMATES, len(heart))))
    estimate = model.log_likelihood(near)
    spread = np.exp(estimate - estimate.max()).std() / np.exp(estimate - estimate.max()).mean()
    return float(logsumexp(estimate) - np.log(ESTIMATES)), float(spread / np.sqrt(ESTIMATES))


@pytest.mark.parametrize(("shares", "discrepancy_share", "seed"), [(SHARED, 0.6, 1), ({}, 0.0, 2)])
def test_the_likelihood_of_both_hearts_is_a_long_average_over_what_measures_them(
    shares: Mapping[str, float], discrepancy_share: float, seed: int
) -> None:
    model, (heart,) = both(shares, discrepancy_share), hearts(1, seed)
    known, found = long_average(model, heart), averaged(model, heart)
    error = np.hypot(known[1], found[1])
    assert error < 0.03
    assert abs(found[0] - known[0]) < 4.0 * error
    other = both(SHARED, 0.6) if not shares else both({}, 0.0)
    assert abs(averaged(other, heart)[0] - known[0]) > 0.5  # so the ties are seen


def test_psi_is_completed_about_the_hearts_and_has_their_likelihood() -> None:
    model, some = both(SHARED, 0.6), hearts(5, seed=3)
    found = model.evaluated(some)
    np.testing.assert_array_equal(model.points(found.phi), some)
    np.testing.assert_allclose(found.log_likelihood_of_phi, in_whole(model, found.phi), rtol=1e-9)
