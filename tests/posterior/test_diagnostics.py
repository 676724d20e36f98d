"""Smoothed weights, R-hat and effective draws: against ArviZ of both generations, and known laws."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from diagnostics_case import REFERENCE, chains, log_ratios
from scipy.stats import genpareto

from swesbi.posterior.diagnostics import effective_number, smooth, split_r_hat

TABLE = pd.read_csv(REFERENCE)


def test_weights_and_k_hat_are_those_of_arviz() -> None:
    smoothed = [smooth(log_ratios(case)) for case in TABLE["case"]]
    k_hat = np.array([k_hat for _, k_hat in smoothed])
    squares = [np.exp(2.0 * log_weight).sum() for log_weight, _ in smoothed]
    np.testing.assert_allclose(k_hat, TABLE["k_hat"], atol=1e-6)
    np.testing.assert_allclose(squares, TABLE["sum_of_squares"], rtol=1e-6)
    # its newer generation takes a tail of another length
    np.testing.assert_allclose(k_hat, TABLE["k_hat_of_arviz_stats"], atol=0.15)


def test_r_hat_and_effective_draws_are_those_of_arviz() -> None:
    found = [chains(case) for case in TABLE["case"]]
    np.testing.assert_allclose([split_r_hat(one[..., None])[0] for one in found], TABLE["r_hat"], rtol=1e-6)
    np.testing.assert_allclose([effective_number(one) for one in found], TABLE["effective_number"], rtol=1e-6)


def test_equal_ratios_are_the_best_and_few_cannot_tell() -> None:
    log_weight, k_hat = smooth(np.full(50, -3.0))
    np.testing.assert_allclose(np.exp(log_weight), 0.02)
    assert k_hat == 0.0
    assert smooth(np.array([0.0, -1.0, -2.0]))[1] == np.inf


@pytest.mark.parametrize("shape", [0.2, 0.5, 0.9])
def test_k_hat_finds_a_known_shape(shape: float) -> None:
    ratios = genpareto(shape).rvs(20_000, random_state=np.random.default_rng(3))
    assert smooth(np.log(ratios))[1] == pytest.approx(shape, abs=0.12)


@pytest.mark.filterwarnings("error")
def test_weights_of_a_recording_far_outside_are_unreliable_without_a_warning() -> None:
    """The largest ratio is all; the library's fit of the others' tail overflows."""
    draws = np.random.default_rng(1).exponential(size=(3, 1000))
    for log_ratio in -1e5 * draws**2:
        log_weight, k_hat = smooth(log_ratio)
        assert k_hat > 10.0
        assert np.exp(log_weight).sum() == pytest.approx(1.0)
