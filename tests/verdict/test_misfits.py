from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from numpy.typing import NDArray
from scipy.stats import kstest

from swesbi.measurement.likelihood import SpeedModel, draw_speeds
from swesbi.prior import JointPriorSettings, quantile
from swesbi.verdict.nulls import WITH_STRIPS, boundary_statistic, residuals_p_value, strip_ratios

FloatArray = NDArray[np.float64]


def p_values_of_noise(count: int, factor: float, model: SpeedModel) -> list[float]:
    """Posterior predictive p-values of the residuals at the true phi, of noise ``factor`` times as large."""
    predicted, rng = model.predict(speed_case.PHI[None]), np.random.default_rng(5)
    found = []
    for _ in range(count):
        noise = draw_speeds(predicted, model.recording.errors, model.settings.discrepancy, rng)[0]
        speeds = np.exp(predicted.log_speed[0] + factor * (np.log(noise) - predicted.log_speed[0]))
        own = replace(model, recording=replace(model.recording, speed_m_s=speeds))
        found.append(residuals_p_value(own.chi_squared(predicted, rng), len(own.recording.phase)))
    return found


def test_residuals_of_replicated_noise_are_uniform_and_larger_noise_is_found() -> None:
    for model in (speed_case.model(), speed_case.model_of_sweeps()):
        assert kstest(p_values_of_noise(400, 1.0, model), "uniform").pvalue > 0.01
        assert kstest(p_values_of_noise(400, 1.2, model), "uniform").pvalue < 1e-4
        assert np.mean(np.array(p_values_of_noise(200, 2.0, model)) < 0.01) > 0.8


def weighted(u: FloatArray) -> tuple[FloatArray, FloatArray, JointPriorSettings]:
    """Return equally weighted draws at these levels of the prior, (n, d), and the prior."""
    prior = speed_case.settings("calibrated").prior
    return quantile(u, prior), np.full(len(u), 1 / len(u)), prior


def test_draws_of_the_prior_have_its_mass_at_every_face() -> None:
    prior = speed_case.settings("calibrated").prior
    ratios = strip_ratios(*weighted(np.random.default_rng(6).random((200_000, len(prior.names)))))
    assert ratios[[WITH_STRIPS.index(name) for name in prior.names]] == pytest.approx(1.0, abs=0.1)
    assert boundary_statistic(ratios[None]) == pytest.approx([0.0], abs=0.01)


@pytest.mark.parametrize("name", speed_case.settings("calibrated").prior.names)
@pytest.mark.parametrize("bound", [0, 1])
def test_a_posterior_at_any_face_of_the_box_is_seen(name: str, bound: int) -> None:
    """Parameters and nuisances, also where the prior has much: within 1 % of it every strip is full."""
    u = np.full((200, len(speed_case.settings("calibrated").prior.names)), 0.5)
    amid = strip_ratios(*weighted(u))
    u[:, speed_case.settings("calibrated").prior.names.index(name)] = abs(bound - 0.005)
    ratios = strip_ratios(*weighted(u))
    assert ratios[WITH_STRIPS.index(name), bound] == pytest.approx((100.0 + 50.0 + 25.0) / 3.0)
    assert np.nansum(ratios - amid) == pytest.approx(175.0 / 3.0)
    # one face more in all of them, of which there are two a parameter
    expected = np.log10((np.nansum(amid) + 175.0 / 3.0) / np.isfinite(amid).sum())
    assert boundary_statistic(ratios[None])[0] == pytest.approx(expected)
    assert boundary_statistic(ratios[None])[0] > 0.15 > 0.0 > boundary_statistic(amid[None])[0]


def test_what_is_fixed_has_no_face() -> None:
    prior = speed_case.settings().prior
    ratios = strip_ratios(quantile(np.full((10, 4), 0.5), prior), np.full(10, 0.1), prior)
    np.testing.assert_array_equal(ratios[:4], 0.0)
    np.testing.assert_array_equal(ratios[4:], np.nan)
