"""The checks pass the right posterior and catch each way of breaking it."""

import numpy as np
import pytest
import speed_case
from calibration_case import (
    MIXING,
    NOISE_SD,
    PRIOR,
    Sampler,
    checks_of,
    flagged,
    phi_of,
    quantities_of,
    simulate,
)

from swesbi.base.arrays import below_each_other
from swesbi.checks.calibration.ranks import (
    QUANTITY_NAMES,
    RankScores,
    level_of_truth,
    moments,
    quantities,
    quantity_names,
    rank,
    reference_points,
    tarp_level,
    uniformity,
)
from swesbi.checks.calibration.table import CONTRACTION, COVERAGE, SBC, TARP
from swesbi.draws import equal_weights
from swesbi.prior import log_centre

RECORDINGS = 1000
PARAMETERS = QUANTITY_NAMES[:4]
COVARIANCE = np.linalg.inv(MIXING.T @ MIXING / NOISE_SD**2 + np.eye(4))
"""Of the right posterior."""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_right_posterior_passes_every_check(seed: int) -> None:
    assert flagged(checks_of(simulate(RECORDINGS, Sampler(), seed=seed))) == set()


@pytest.mark.parametrize("narrow", [Sampler(noise_factor=0.8), Sampler(times_used=2)])
def test_noise_a_fifth_too_small_and_data_used_twice_are_caught(narrow: Sampler) -> None:
    checks = checks_of(simulate(RECORDINGS, narrow))
    assert flagged(checks, SBC) & set(PARAMETERS)
    assert flagged(checks, COVERAGE) >= {"k_sr_per_s", "isometric_stiffness_kpa"}
    assert flagged(checks, TARP) == {"joint"}


def test_the_prior_returned_passes_ranks_of_parameters_but_not_contraction() -> None:
    checks = checks_of(simulate(RECORDINGS, Sampler(data_used=False)))
    assert not flagged(checks, SBC, COVERAGE) & set(PARAMETERS)
    assert flagged(checks, TARP) == set()
    assert flagged(checks, CONTRACTION) >= set(PARAMETERS)
    # the one ranked quantity that depends on the data finds it as well
    assert "log_likelihood" in flagged(checks, SBC)


def test_a_shift_by_a_quarter_of_the_posterior_sd_is_caught() -> None:
    assert flagged(checks_of(simulate(RECORDINGS, Sampler(shift=0.25))), SBC)


def test_contraction_and_coverage_stand_beside_the_ranks() -> None:
    checks = checks_of(simulate(RECORDINGS, Sampler()))
    sbc = checks[checks["test"] == SBC].set_index("quantity")
    expected = 1.0 - COVARIANCE[2, 2]  # of log theta; of theta itself it is near
    assert sbc.loc["k_sr_per_s", "contraction"] == pytest.approx(expected, abs=0.05)
    # binomial standard deviation 0.0095
    assert sbc.loc["k_sr_per_s", "coverage_90"] == pytest.approx(0.9, abs=0.04)
    assert np.isnan(sbc.loc["log_likelihood", "contraction"])


def test_coverage_is_that_of_central_intervals() -> None:
    scores, nominal = simulate(200, Sampler(noise_factor=0.6)), np.arange(1, 100) / 100.0
    found = checks_of(scores).set_index(["test", "quantity"])["statistic"]
    for level, name in zip(scores.level.T, QUANTITY_NAMES, strict=True):
        covered = (np.abs(2.0 * level[:, None] - 1.0) <= nominal + 1e-12).mean(axis=0)
        assert found[COVERAGE, name] == pytest.approx(np.abs(covered - nominal).max(), abs=0.0051)
        assert found[SBC, name] == uniformity(level).distance


@pytest.mark.parametrize("use_weights", [True, False])
def test_draws_of_a_wider_and_shifted_proposal_are_ranked_by_their_weight(use_weights: bool) -> None:
    rng, root, scores = np.random.default_rng(8), np.linalg.cholesky(COVARIANCE), []
    for reference in reference_points(RECORDINGS, PRIOR, rng):
        truth = rng.standard_normal(4)
        y = MIXING @ truth + NOISE_SD * rng.standard_normal(len(MIXING))
        standard = 1.3 * rng.standard_normal((400, 4)) + 0.3
        x = COVARIANCE @ MIXING.T @ y / NOISE_SD**2 + standard @ root.T
        log_weight = 0.5 * (((standard - 0.3) / 1.3) ** 2 - standard**2).sum(axis=1)
        weight = np.exp(log_weight - log_weight.max()) if use_weights else np.ones(400)
        known, drawn = quantities_of(truth[None], y)[0], quantities_of(x, y)
        scores.append(rank(known, drawn, weight / weight.sum(), reference, PRIOR))
    checks = checks_of(below_each_other(scores))
    if use_weights:
        assert flagged(checks) == set()
    else:
        assert flagged(checks, SBC) >= set(PARAMETERS)


def test_equal_weights_give_exactly_uniform_mid_ranks() -> None:
    draws = np.arange(9.0)[:, None]
    levels = [level_of_truth(np.array([t]), draws, equal_weights(9))[0] for t in (-1.0, 3.5, 9.0)]
    assert levels == pytest.approx([0.05, 0.45, 0.95])
    tied = level_of_truth(np.array([2.0]), draws, equal_weights(9))[0]
    assert tied == pytest.approx((2.5 + 0.5) / 10)


def test_a_weight_counts_like_repeated_draws() -> None:
    draws, weight = np.array([[0.0], [1.0], [2.0]]), np.array([0.5, 0.25, 0.25])
    repeated = np.array([[0.0], [0.0], [1.0], [2.0]])
    for one, other in zip(moments(draws, weight), moments(repeated, equal_weights(4)), strict=True):
        assert one == pytest.approx(other)


def test_a_draw_without_likelihood_leaves_no_moments_where_it_carries_weight(
    recwarn: pytest.WarningsRecorder,
) -> None:
    draws = np.array([[1.0, 1.0], [3.0, -np.inf], [-np.inf, -np.inf]])
    mean, sd = moments(draws, np.array([0.5, 0.5, 0.0]))
    np.testing.assert_array_equal(mean, [2.0, -np.inf])
    np.testing.assert_array_equal(sd, [1.0, np.nan])
    assert not recwarn


@pytest.mark.parametrize(("sign", "caught"), [(1.0, False), (-1.0, True)])
def test_joint_coverage_sees_a_wrong_correlation_that_no_margin_shows(sign: float, caught: bool) -> None:
    """Every margin is right; the correlation of k_0 and k_ATP has the wrong sign."""
    rng = np.random.default_rng(9)
    covariance, wrong = np.eye(4), np.eye(4)
    covariance[0, 1] = covariance[1, 0] = -0.9
    wrong[0, 1] = wrong[1, 0] = sign * -0.9
    levels = []
    for reference in reference_points(800, PRIOR, rng):
        truth = rng.multivariate_normal(np.zeros(4), covariance)
        draws = rng.multivariate_normal(np.zeros(4), wrong, 199)
        levels.append(tarp_level(phi_of(truth), phi_of(draws), equal_weights(199), reference, PRIOR))
    assert (uniformity(np.array(levels)).p_value < 1e-3) == caught


BESIDE = speed_case.settings("calibrated").prior
"""Which has nuisances beside what is reported."""


def scores_beside(nuisance_sd: float) -> RankScores:
    """Posteriors that are the prior: right in what is reported, and in nuisances of this width."""
    rng, draws = np.random.default_rng(11), 199
    centre, log_sd = log_centre(BESIDE), np.array([part.log_sd for part in BESIDE.parameters])
    width = np.repeat([1.0, nuisance_sd], [4, len(log_sd) - 4])
    scores = []
    for reference in reference_points(RECORDINGS, BESIDE, rng):
        standard = rng.standard_normal((1 + draws, len(log_sd)))
        x = np.vstack([standard[:1], width * standard[1:]])
        values = quantities(centre * np.exp(log_sd * x), rng.standard_normal(len(x)), 0.32)
        scores.append(rank(values[0], values[1:], equal_weights(draws), reference, BESIDE))
    return below_each_other(scores)


def test_nuisances_are_ranked_by_name_behind_the_quantities() -> None:
    phi = log_centre(BESIDE)
    values = quantities(phi[None], np.array([-7.0]), 0.32)[0]
    named = dict(zip(quantity_names(BESIDE), values, strict=True))
    assert named.pop("isometric_stiffness_kpa") == pytest.approx(phi[0] * (1.0 - np.exp(-phi[1] * 0.32)))
    assert named.pop("log_likelihood") == -7.0
    assert named == dict(zip(BESIDE.names, phi, strict=True))


@pytest.mark.parametrize(("nuisance_sd", "caught"), [(1.0, False), (0.3, True)])
def test_ranks_and_joint_coverage_are_of_all_of_phi(nuisance_sd: float, caught: bool) -> None:
    """Nuisances too narrow are found, each by its name and jointly; what is reported stays right."""
    variance = np.ones((RECORDINGS, len(quantity_names(BESIDE))))
    checks = checks_of(scores_beside(nuisance_sd), variance, quantity_names(BESIDE))
    assert flagged(checks, SBC) == (set(BESIDE.names[4:]) if caught else set())
    assert flagged(checks, TARP) == ({"joint"} if caught else set())
