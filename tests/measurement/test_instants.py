"""The likelihood at any instants against dense normal densities, quadrature and gated phases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.shared_error import (
    CellData,
    CellErrors,
    cell_innovations,
    cell_sums,
    error_factors,
    likeliest_factor,
)
from swesbi.prior import draw_prior

DISCREPANCY = DiscrepancySettings(speed_fraction=0.03, timing_cycle=0.02)


def test_pushes_of_a_cell_share_the_models_error() -> None:
    rng = np.random.default_rng(2)
    cell = np.array([0, 0, 0, 3, 7, 7])
    se = rng.uniform(0.02, 0.1, 6)
    distance, slope = 0.1 * rng.standard_normal((5, 6)), 3.0 * rng.standard_normal((5, 6))
    made = CellData(distance, slope, se, cell, DISCREPANCY.speed_fraction, DISCREPANCY.timing_cycle)
    told, sums = cell_innovations(made).log_density, cell_sums(made)
    wider = cell_innovations(replace(made, se=1.7 * se))
    np.testing.assert_allclose(sums.log_density(1.7), wider.log_density, rtol=1e-12)
    np.testing.assert_allclose(sums.chi_squared(np.full(5, 1.7)), wider.chi_squared, rtol=1e-12)
    np.testing.assert_allclose(sums.log_density(), told, rtol=1e-12)
    same = cell[:, None] == cell[None]
    for row in range(5):
        moved = 0.02**2 * np.outer(slope[row], slope[row])
        covariance = np.diag(se**2) + same * (0.03**2 + moved)
        dense = multivariate_normal(np.zeros(6), covariance).logpdf(distance[row])
        assert told[row] == pytest.approx(dense, abs=1e-10)


@pytest.mark.parametrize("pushes", [2, 30, 400])
def test_an_unknown_factor_of_the_errors_is_integrated_out(pushes: int) -> None:
    """Against adaptive quadrature over the factor, for pushes of independent errors."""
    log_sd, se = 0.4, 0.1
    distance = 0.14 * np.random.default_rng(pushes).standard_normal(pushes)

    def log_joint(u: float) -> float:
        return float(norm.logpdf(distance, scale=se * np.exp(log_sd * u)).sum() + norm.logpdf(u))

    top = max(log_joint(u) for u in np.linspace(-3, 3, 601))
    mass, _ = quad(lambda u: np.exp(log_joint(u) - top), -6, 6, epsabs=1e-13, limit=400)
    factors, log_weight = error_factors(log_sd, pushes)
    rows = [norm.logpdf(distance, scale=se * factor).sum() for factor in factors]
    assert logsumexp(np.array(rows) + log_weight) == pytest.approx(top + np.log(mass), abs=1e-6)


def test_known_errors_have_one_factor() -> None:
    factors, log_weight = error_factors(0.0, 10)
    assert (factors.tolist(), log_weight.tolist()) == ([1.0], [0.0])


def test_one_push_a_cell_is_a_gated_phase() -> None:
    gated = speed_case.model()
    phi = draw_prior(gated.settings.prior, 50, np.random.default_rng(0))
    free = replace(gated, recording=replace(gated.recording, cell=np.arange(20)))
    np.testing.assert_allclose(free.log_likelihood(phi), gated.log_likelihood(phi), rtol=1e-12)


def test_repeats_as_pushes_say_what_their_mean_says() -> None:
    """Three pushes at each phase differ from their mean by a factor that does not depend on phi."""
    gated = speed_case.model()
    recording = gated.recording
    apart = 0.05 * np.random.default_rng(1).standard_normal((20, 3))
    apart -= apart.mean(axis=1, keepdims=True)
    pushes = replace(
        recording,
        phase=np.repeat(recording.phase, 3),
        speed_m_s=(recording.speed_m_s[:, None] * np.exp(apart)).ravel(),
        relative_se=np.repeat(recording.relative_se * np.sqrt(3.0), 3),
        shared=np.empty((60, 0)),
        cell=np.repeat(np.arange(20), 3),
    )
    free = replace(gated, recording=pushes)
    phi = draw_prior(gated.settings.prior, 50, np.random.default_rng(0))
    beside = free.log_likelihood(phi) - gated.log_likelihood(phi)
    np.testing.assert_allclose(beside, beside[0], atol=1e-8)


def test_errors_that_a_cell_shares_are_solved_for_without_their_matrix() -> None:
    rng, cell = np.random.default_rng(7), np.array([0, 0, 2, 2, 2, 5])
    sd, values = rng.uniform(0.05, 0.2, (3, 6)), rng.standard_normal((3, 6, 2))
    found = CellErrors(sd, cell, 0.1).solve(values)
    for row in range(3):
        dense = np.diag(sd[row] ** 2) + 0.01 * (cell[:, None] == cell)
        np.testing.assert_allclose(found[row], np.linalg.solve(dense, values[row]), rtol=1e-10)


@pytest.mark.parametrize("chi_squared", [3.0, 12.0, 40.0])
def test_the_likeliest_factor_of_all_errors_is_where_their_density_is_largest(chi_squared: float) -> None:
    pushes, log_sd = 12, 0.4
    best = minimize_scalar(
        lambda u: pushes * u + 0.5 * chi_squared * np.exp(-2.0 * u) + 0.5 * (u / log_sd) ** 2, (-1.0, 1.0)
    )
    found = likeliest_factor(np.array([chi_squared]), pushes, log_sd)
    np.testing.assert_allclose(found, np.exp(best.x), rtol=1e-5)
