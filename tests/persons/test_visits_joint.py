"""Visits of one person: the prior that ties them, the likelihood of all recordings."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import speed_case
from scipy.linalg import block_diag
from scipy.stats import kstest, multivariate_normal, norm

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.measurement.likelihood import SpeedModel, log_speed_sd
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.persons.change.visits import Coupling, VisitsModel, visits_model
from swesbi.posterior.space import ScoreSpace, normal_scores
from swesbi.prior import JointPriorSettings, draw_prior, in_bounds, log_density, sample

TIED = ("passive_ratio", "destruction_alpha", "speed_scale")


def prior() -> JointPriorSettings:
    chosen: JointPriorSettings = speed_case.settings("calibrated").prior
    return chosen


def shares(share: float) -> FloatArray:
    return np.array([share if name in TIED else 0.0 for name in prior().names])


def draws(coupling: Coupling, count: int) -> tuple[FloatArray, FloatArray]:
    psi = sample(count, coupling.joint, np.random.default_rng(1))
    return psi, coupling.phi(psi)


def test_visits_that_share_nothing_are_independent_to_the_bit() -> None:
    psi, phi = draws(Coupling(prior(), shares(0.0), 2), 50)
    np.testing.assert_array_equal(np.hstack(list(phi)), psi)


def test_psi_of_the_visits_is_where_they_came_from() -> None:
    coupling = Coupling(prior(), shares(0.9), 3)
    psi, phi = draws(coupling, 50)
    np.testing.assert_allclose(coupling.psi(phi), psi, rtol=1e-6)


def test_each_visit_keeps_its_prior_and_scores_are_correlated_by_the_share() -> None:
    coupling = Coupling(prior(), shares(0.8), 3)
    _, phi = draws(coupling, 4000)
    scores = np.stack([normal_scores(each, prior()) for each in phi])
    for visit in scores:
        for column in visit.T:
            assert kstest(column, norm.cdf).pvalue > 1e-4
    for j, name in enumerate(prior().names):
        correlation = np.asarray(np.corrcoef(scores[:, :, j]))[np.triu_indices(3, 1)]
        np.testing.assert_allclose(correlation, 0.8 if name in TIED else 0.0, atol=0.06)


@cache
def pair(timing_cycle: float) -> tuple[tuple[SpeedModel, ...], tuple[IntArray, ...]]:
    """Return two recordings in sweeps, each without phases of its own; one has another heart rate."""
    made = speed_case.model_of_sweeps()
    discrepancy = DiscrepancySettings(speed_fraction=0.02, timing_cycle=timing_cycle)
    settings = made.settings.model_copy(update={"discrepancy": discrepancy})
    models, kept = [], []
    for visit, missing in enumerate(([3], [0, 9, 15])):
        index = np.delete(np.arange(20), missing)
        recording = replace(
            made.recording,
            context=replace(made.recording.context, hr_bpm=66.0 + 4.0 * visit),
            phase=made.recording.phase[index],
            speed_m_s=made.recording.speed_m_s[index] * (1.0 + 0.01 * visit),
            relative_se=made.recording.relative_se[index],
            shared=made.recording.shared[index],
        )
        models.append(SpeedModel(recording, settings))
        kept.append(index)
    return tuple(models), tuple(kept)


def visits(share: float, timing_cycle: float) -> VisitsModel:
    models, kept = pair(timing_cycle)
    return visits_model(models, kept, np.zeros(4), share)


def log_likelihood(model: VisitsModel, psi: FloatArray) -> FloatArray:
    """Return log p(both recordings | psi) of psi (n, 2 d), each simulated in whole."""
    walls = [one.wall(phi) for one, phi in zip(model.models, model.coupling.phi(psi), strict=True)]
    return model.log_density_about(model.predicted(psi, walls))


@pytest.mark.parametrize("timing_cycle", [0.0, 0.01])
def test_recordings_that_share_no_error_have_the_product_of_their_likelihoods(timing_cycle: float) -> None:
    model = visits(0.0, timing_cycle)
    psi = sample(30, model.prior, np.random.default_rng(2))
    alone = sum(
        one.log_likelihood(phi) for one, phi in zip(model.models, model.coupling.phi(psi), strict=True)
    )
    np.testing.assert_allclose(log_likelihood(model, psi), alone, rtol=1e-9)


@pytest.mark.parametrize("timing_cycle", [0.0, 0.01])
def test_the_shared_discrepancy_is_a_covariance_at_equal_phases(timing_cycle: float) -> None:
    model = visits(0.6, timing_cycle)
    psi = sample(6, model.prior, np.random.default_rng(3))
    predicted = [one.predict(phi) for one, phi in zip(model.models, model.coupling.phi(psi), strict=True)]
    recordings = [one.recording for one in model.models]
    discrepancy = model.models[0].settings.discrepancy
    cross = 0.6 * 0.02**2 * (model.phase_index[0][:, None] == model.phase_index[1])
    assert cross.any() and not cross.all()
    found = log_likelihood(model, psi)
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


def test_one_visit_is_no_pair() -> None:
    models, kept = pair(0.0)
    with pytest.raises(ValueError, match="1 visit of one person: a change needs two"):
        visits_model(models[:1], kept[:1], np.zeros(4), 0.5)


def test_scores_and_their_slope_are_those_of_the_prior() -> None:
    space = ScoreSpace(Coupling(prior(), shares(0.5), 2).joint)
    psi = draw_prior(space.prior, 40, np.random.default_rng(4))
    u, log_slope = space.place(psi)
    np.testing.assert_allclose(space.at(u), psi, rtol=1e-9)
    np.testing.assert_allclose(norm.logpdf(u).sum(axis=1) + log_slope, log_density(psi, space.prior))
    assert in_bounds(space.at(np.full((1, u.shape[1]), 50.0)), space.prior).all()
