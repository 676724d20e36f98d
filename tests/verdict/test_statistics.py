"""The tests themselves: feature space, predictive tails, bounds, volumes, context."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from numpy.typing import NDArray
from scipy.stats import kstest, norm

from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel, draw_speeds
from swesbi.parameters import PHI_NAMES
from swesbi.prior import quantile
from swesbi.verdict.context import context_tests, leave_one_out
from swesbi.verdict.settings import ContextCheckSettings
from swesbi.verdict.statistics import (
    IN_LOG,
    WITH_STRIPS,
    boundary_statistic,
    chi2_p_value,
    fit_feature_space,
    prior_strip_mass,
    strip_edges,
    strip_mass,
    tail_probabilities,
    tail_scores,
)

FloatArray = NDArray[np.float64]
RANGES = ContextCheckSettings(level=0.01, ranges={"ivsd_cm": (0.6, 1.0), "lvedv_ml": (46.0, 150.0)})


def features(count: int, seed: int) -> FloatArray:
    """Ten features of three causes: correlated, in different units, one of them constant."""
    rng = np.random.default_rng(seed)
    causes = rng.standard_normal((count, 3))
    mixing = np.random.default_rng(0).standard_normal((3, 10))
    made = causes @ mixing + 0.3 * rng.standard_normal((count, 10))
    made[:, 9] = 4.0
    return np.asarray(made * 10.0 ** np.arange(-4, 6))


def test_distances_in_feature_space_are_like_those_of_the_reference() -> None:
    space = fit_feature_space(features(3000, 1), 0.99, 10)
    null, fresh = features(2000, 2), features(1000, 3)
    for statistic in (space.mahalanobis, space.nearest, space.discrepancy):
        p = (1 + (statistic(null)[None] >= statistic(fresh)[:, None]).sum(axis=1)) / 2001
        assert kstest(p, "uniform").pvalue > 0.01


def test_a_combination_that_the_prior_cannot_make_is_far_though_each_feature_is_usual() -> None:
    reference = features(3000, 1)
    space = fit_feature_space(reference, 0.99, 10)
    odd = reference[:50].copy()
    for j in range(10):  # each feature of another recording: margins kept, relations broken
        odd[:, j] = np.roll(odd[:, j], j)
    usual = features(500, 4)
    for statistic in (space.mahalanobis, space.nearest, space.discrepancy):
        assert (statistic(odd) > np.quantile(statistic(usual), 0.99)).mean() > 0.5


def test_whitened_directions_are_uncorrelated_and_as_many_as_the_features_can_move_in() -> None:
    reference = features(3000, 1)
    space = fit_feature_space(reference, 0.99, 10)
    white = space.whiten(reference)
    assert 3 <= white.shape[1] <= 9
    assert np.cov(white, rowvar=False) == pytest.approx(np.eye(white.shape[1]), abs=1e-6)


def test_mmd_of_one_recording_is_the_two_sample_formula() -> None:
    reference = features(300, 1)
    space = fit_feature_space(reference, 0.99, 5)
    x, points = space.whiten(features(1, 7))[0], space.points
    kernel = np.exp(-space.kernel_gamma * ((points[:, None] - points[None]) ** 2).sum(axis=2))
    cross = np.exp(-space.kernel_gamma * ((points - x) ** 2).sum(axis=1))
    n = len(points)
    expected = 1.0 - 2.0 * cross.mean() + (kernel.sum() - n) / (n * (n - 1))
    assert space.discrepancy(features(1, 7))[0] == pytest.approx(expected, rel=1e-9)


def recordings(count: int, factor: float, model: SpeedModel) -> list[float]:
    """Posterior predictive p-values of chi2 at the true phi, of noise ``factor`` times as large."""
    predicted = model.predict(speed_case.PHI[None])
    rng, discrepancy = np.random.default_rng(5), model.settings.discrepancy
    found = []
    for _ in range(count):
        noise = draw_speeds(predicted, model.recording.errors, discrepancy, rng)[0]
        speeds = np.exp(predicted.log_speed[0] + factor * (np.log(noise) - predicted.log_speed[0]))
        own = replace(model.recording, speed_m_s=speeds)
        found.append(chi2_p_value(predicted, own, discrepancy))
    return found


def test_chi2_of_replicated_noise_is_uniform_and_larger_noise_is_found() -> None:
    for model in (speed_case.model(), speed_case.model_of_sweeps()):
        assert kstest(recordings(400, 1.0, model), "uniform").pvalue > 0.01
        assert kstest(recordings(400, 1.2, model), "uniform").pvalue < 1e-4
        assert np.mean(np.array(recordings(200, 2.0, model)) < 0.01) > 0.8


def test_tail_probabilities_halve_ties() -> None:
    replicated = np.array([[0.0, 1.0], [1.0, 1.0], [2.0, 3.0]])
    assert tail_probabilities(np.array([1.5, 1.0]), replicated) == pytest.approx([2.0 / 3.0, 1.0 / 3.0])
    assert tail_scores(np.array([0.5, 0.975, 0.025])) == pytest.approx([0.0, 1.95996, 1.95996], abs=1e-4)
    assert np.isfinite(tail_scores(np.array([0.0, 1.0]))).all()


def test_strips_hold_the_mass_that_the_prior_has_there() -> None:
    prior = speed_case.settings("calibrated").prior
    phi = quantile(np.random.default_rng(6).random((200_000, len(prior.names))), prior)
    drawn = strip_mass(phi, np.full(len(phi), 1 / len(phi)), prior, 0.1)
    expected = prior_strip_mass(prior, 0.1)
    assert drawn == pytest.approx(expected, abs=4 * np.sqrt(0.25 / len(phi)))
    assert strip_edges(prior, 0.1)[1][1] == pytest.approx(27.2)
    assert expected[1, 1] == pytest.approx(0.0012, abs=0.0002)


@pytest.mark.parametrize("fraction", [0.02, 0.1, 0.3])
def test_strips_in_the_logarithm_are_rare_whatever_the_fraction(fraction: float) -> None:
    """At each bound a share of the box, or 4 % of the prior if that is less."""
    prior = speed_case.settings("calibrated").prior
    lower, upper = strip_edges(prior, fraction)
    masses = prior_strip_mass(prior, fraction)[len(PHI_NAMES) :]
    assert WITH_STRIPS[len(PHI_NAMES) :] == IN_LOG == ("length_dependence", "passive_ratio")
    assert (masses > 0.0).all() and (masses <= 0.04 + 1e-12).all()
    for name, ends, mass in zip(IN_LOG, list(zip(lower, upper, strict=True))[4:], masses, strict=True):
        of = prior.parameters[prior.names.index(name)]
        width = np.log(ends[0] / of.low), np.log(of.high / ends[1])
        for strip, held in zip(width, mass, strict=True):
            of_box = strip == pytest.approx(fraction * np.log(of.high / of.low))
            assert of_box or (held == pytest.approx(0.04) and strip < fraction * np.log(of.high / of.low))


@pytest.mark.parametrize("name", IN_LOG)
@pytest.mark.parametrize("bound", [0, 1])
def test_a_posterior_within_a_strip_in_the_logarithm_is_flagged(name: str, bound: int) -> None:
    prior = speed_case.settings("calibrated").prior
    phi = np.tile(quantile(np.full((1, len(prior.names)), 0.5), prior), (200, 1))
    weight, prior_mass = np.full(200, 1 / 200), prior_strip_mass(prior, 0.1)
    amid = boundary_statistic(strip_mass(phi, weight, prior, 0.1)[None], prior_mass, 0.05)
    assert amid == pytest.approx([-3.0])  # of no mass in any strip
    of, row = prior.parameters[prior.names.index(name)], WITH_STRIPS.index(name)
    edge, end = strip_edges(prior, 0.1)[bound][row], (of.low, of.high)[bound]
    phi[:, prior.names.index(name)] = np.geomspace(end, edge, 202)[1:-1]
    mass = strip_mass(phi, weight, prior, 0.1)
    assert mass[row, bound] == pytest.approx(1.0) and mass.sum() == pytest.approx(1.0)
    found = boundary_statistic(mass[None], prior_mass, 0.05)
    assert found == pytest.approx([-np.log10(prior_mass[row, bound])])
    assert found[0] > np.log10(20.0)


def test_what_is_fixed_has_no_strips_that_could_speak() -> None:
    prior = speed_case.settings().prior
    phi = quantile(np.random.default_rng(6).random((10, 4)), prior)
    np.testing.assert_array_equal(strip_mass(phi, np.full(10, 0.1), prior, 0.1)[4:], 0.0)
    np.testing.assert_array_equal(prior_strip_mass(prior, 0.1)[4:], 1.0)


def test_only_rare_strips_speak_and_by_the_ratio_to_the_prior() -> None:
    prior_mass = np.array([[0.4, 0.001], [0.03, 0.2]])
    mass = np.zeros((3, 2, 2))
    mass[0, 0, 0] = 1.0  # all of the posterior where the prior expects it
    mass[1, 0, 1] = 0.05
    mass[2, 1, 0] = 0.9
    found = boundary_statistic(mass, prior_mass, 0.05)
    assert found == pytest.approx([-3.0, np.log10(50.0), np.log10(30.0)])


def healthy_context(i: int) -> Context:
    return Context(
        f"H{i}", "F", 20.0 + i, 1.6 + 0.05 * i, 60.0 + 2 * i, 80.0 + 5 * i, 30.0 + 2 * i, 0.68 + 0.02 * i
    )


def test_a_subject_unlike_the_others_is_found_where_pooled_z_scores_cannot() -> None:
    healthy = [healthy_context(i) for i in range(5)]
    thick = Context("P", "F", 23.0, 1.7, 64.0, 90.0, 34.0, 1.4)
    values = np.array([one.ivsd_cm for one in (*healthy, thick)])
    assert abs((1.4 - values.mean()) / values.std()) < np.sqrt(5) + 1e-9
    left_out, ranges = context_tests(thick, healthy, RANGES)
    assert left_out.flagged
    assert "ivsd_cm = 1.4" in left_out.detail
    assert ranges.flagged
    assert "ivsd_cm = 1.4 outside [0.6, 1]" in ranges.detail
    assert not any(test.flagged for test in context_tests(healthy[2], (*healthy[:2], *healthy[3:]), RANGES))


def test_few_others_leave_the_declared_ranges() -> None:
    one = Context("A", "F", 23.0, 1.7, 64.0, 90.0, 34.0, 0.8)
    assert [test.name for test in context_tests(one, (one, one), RANGES)] == ["context_ranges"]


def test_leave_one_out_p_values_are_uniform() -> None:
    draws = np.random.default_rng(8).standard_normal((2000, 6, 1))
    p = [leave_one_out(sample[0], sample[1:])[1][0] for sample in draws]
    assert kstest(p, "uniform").pvalue > 0.01
    same = leave_one_out(np.array([1.0, 2.0]), np.ones((4, 2)))[1]
    assert same == pytest.approx([1.0, 0.0])


def test_scores_of_uniform_tails_are_normal_up_to_what_draws_resolve() -> None:
    tails = (np.arange(20_000) + 0.5) / 20_000
    assert (tail_scores(tails) ** 2).mean() == pytest.approx(1.0, abs=0.03)
    assert tail_scores(np.array([0.9999]))[0] == pytest.approx(norm.ppf(0.999), abs=1e-9)
