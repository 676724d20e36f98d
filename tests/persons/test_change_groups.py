"""What has changed in groups, on persons whose posteriors are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import arviz
import hierarchy_case as case
import numpy as np
import pytest
import ratio_case
import separable_case as separable
from figure_text import assert_text_apart
from scipy.stats import binom, ks_2samp, kstest, norm

from swesbi.artefacts import Provenance
from swesbi.base.arrays import FloatArray
from swesbi.persons.change.groups import doubts
from swesbi.persons.change.words import group_lines
from swesbi.persons.cohort import model as population_model
from swesbi.persons.cohort.cohort import Design, design_of
from swesbi.persons.cohort.hyperprior import Hyperprior, hyperprior_of
from swesbi.persons.cohort.infer import CohortResult, infer_population, of_ratios
from swesbi.persons.cohort.model import CohortModel
from swesbi.persons.cohort.ratio import RatioPrior, log_density
from swesbi.persons.cohort.refresh import shrunken_prior
from swesbi.persons.cohort.stored import CohortPosterior, stored_form
from swesbi.persons.cohort.table import (
    CHANGE_COLUMNS,
    DIFFERENCE,
    PERSON_COLUMNS,
    RATIO,
    RATIO_SPREAD,
    change_table,
    person_table,
)
from swesbi.prior import bounds, draw_prior, sample
from swesbi.report.figures.cohort_posterior import draw_change_groups

PRIOR = RatioPrior(case.THETA_PRIOR)
EFFECT = np.log([1.1, 1.0, 0.75])
SPREADS = np.array([0.06, 0.08, 0.08])
GROUPS = ("treated", "control") * 7
TITLE = "persons without hearts"
QUANTITY = of_ratios(case.THETA_PRIOR, ratio_case.SETTINGS.hyperprior)


def ratio_prior(design: Design) -> Hyperprior:
    return hyperprior_of(design, QUANTITY.median, QUANTITY.hyperprior)


def test_the_prior_of_a_ratio_is_that_of_two_visits() -> None:
    rng = np.random.default_rng(1)
    earlier, later = (sample(50_000, case.THETA_PRIOR, rng) for _ in range(2))
    log_ratio = np.log(later / earlier)
    low, high = (np.log(limit) for limit in bounds(PRIOR))
    middle = log_density(np.ones((1, 3)), PRIOR)[0]
    log_integral = 0.0
    for j in range(3):
        grid = np.linspace(low[j] + 1e-9, high[j] - 1e-9, 2001)
        rows = np.zeros((len(grid), 3))
        rows[:, j] = grid
        relative = np.exp(log_density(np.exp(rows), PRIOR) + grid - middle)
        log_integral += np.log(np.trapezoid(relative, grid))
        passed = np.cumsum(relative) / relative.sum()
        for level in (-0.9, -0.3, 0.2, 0.8):
            share = float(np.interp(level, grid, passed))
            assert share == pytest.approx((log_ratio[:, j] < level).mean(), abs=0.01)
    assert log_integral + middle == pytest.approx(0.0, abs=1e-3)
    assert log_density(np.array([[1.0, 16.0, 1.0]]), PRIOR)[0] == -np.inf


def cohort(effect: FloatArray = EFFECT, groups: tuple[str, ...] = GROUPS, seed: int = 3) -> CohortResult:
    rng = np.random.default_rng(seed)
    mean = np.where((np.array(groups) == "treated")[:, None], effect, 0.0)
    return ratio_case.infer(
        ratio_case.members_of(ratio_case.true_ratios(mean, SPREADS, rng), groups, seed), seed
    )


@pytest.fixture(scope="module")
def inferred() -> CohortResult:
    return cohort()


@pytest.fixture(scope="module")
def stored(inferred: CohortResult) -> CohortPosterior:
    return stored_form(inferred, ("left out with one visit, since a change needs two: P99",))


def test_groups_differ_by_what_was_put_in(stored: CohortPosterior) -> None:
    assert stored.converged
    assert stored.groups == ("treated", "control")
    table = change_table(stored)
    assert tuple(table.columns) == CHANGE_COLUMNS
    assert len(table) == 3 * (2 + 1 + 1)
    between = table[table["quantity"] == DIFFERENCE].set_index("parameter")
    truth = dict(zip(between.index, np.exp(-EFFECT), strict=True))
    for parameter, row in between.iterrows():
        half_width = 0.5 * np.log(row["high_1"] / row["low_1"])  # 1.6 sd; three are asked at once, so 2.6 sd
        assert abs(np.log(truth[str(parameter)] / row["median_1"])) < 1.6 * half_width
    assert between.loc["k_sr_per_s", "probability_above_1"] > 0.9
    of_control = table[(table["quantity"] == RATIO) & (table["of"] == "control")]
    assert (of_control["persons"] == 7).all()
    assert np.isnan(table[table["quantity"] == RATIO_SPREAD]["probability_above_1"]).all()


def test_ratios_of_persons_lean_on_their_group(stored: CohortPosterior) -> None:
    table = person_table(stored)
    assert tuple(table.columns) == PERSON_COLUMNS
    assert len(table) == 3 * len(GROUPS)
    width = np.log(table["high_1"] / table["low_1"])
    assert (width / np.log(table["alone_high_1"] / table["alone_low_1"])).mean() < 0.9
    assert (table["effective_draws"] > 5).all()


def test_without_the_division_by_the_prior_of_the_ratio_the_likelihood_differs(
    inferred: CohortResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    eta = inferred.eta[:40].copy()
    eta[:, :3] = np.exp(0.6)  # far from 1, where the prior of a ratio is far from flat
    eta[:, 3:6] = 0.3
    right = inferred.model.log_likelihood(eta)
    monkeypatch.setattr(population_model, "log_density", lambda ratio, prior: -np.log(ratio).sum(axis=1))
    broken = replace(inferred.model).log_likelihood(eta)
    assert np.ptp(broken - right) > 1.0 or np.abs(broken - right - np.median(broken - right)).max() > 1.0


def on_a_grid(measured: tuple[case.Measured, case.Measured], person: int, j: int) -> tuple[FloatArray, ...]:
    """Return log ratios delta, p(both visits | delta) and its prior, by quadrature over the earlier visit."""
    prior = case.THETA_PRIOR.parameters[j]
    grid = np.linspace(np.log(prior.low), np.log(prior.high), 1201)
    step = grid[1] - grid[0]
    at_visit = norm.pdf(grid, np.log(prior.centre), prior.log_sd)
    at_visit /= at_visit.sum() * step
    earlier, later = (
        at_visit * norm.pdf(one.log_theta[person, j], grid, one.error_sd[person, j]) for one in measured
    )
    of_delta = np.convolve(at_visit, at_visit[::-1]) * step
    return (
        step * np.arange(-1200, 1201),
        np.convolve(later, earlier[::-1]) * step / of_delta,
        of_delta / of_delta.sum(),
    )


def evidence_on_a_grid(measured: tuple[case.Measured, case.Measured], eta: FloatArray) -> float:
    """Return log p(data | eta) / p(data) of the first person, by quadrature over both visits."""
    found = 0.0
    for j in range(3):
        delta, likelihood, of_delta = on_a_grid(measured, 0, j)
        population = norm.pdf(delta, np.log(eta[j]), eta[3 + j])
        found += np.log(population @ likelihood / population.sum() / (of_delta @ likelihood))
    return float(found)


def test_the_evidence_of_a_person_is_that_by_quadrature() -> None:
    delta = np.array([[0.05, -0.1, -0.2]])
    measured = ratio_case.measured_visits(delta, 5)
    members = ratio_case.members_of(delta, ("",), 5, draws=40_000)
    design = design_of(members, covariates=())
    prior = ratio_prior(design)
    model = CohortModel(
        population_model.PriorAlone(prior),
        case.equal_draws([members[0].theta]),
        design.matrix,
        np.zeros(1),
        PRIOR,
    )
    eta = np.array([[1.0, 0.9, 0.85, 0.1, 0.15, 0.12], [1.1, 1.4, 1.2, 0.2, 0.3, 0.2]])
    expected = [evidence_on_a_grid(measured, row) for row in eta]
    assert model.log_likelihood(eta) == pytest.approx(expected, abs=0.1)


def test_a_pair_that_is_none_counts_little(stored: CohortPosterior) -> None:
    rng = np.random.default_rng(7)
    delta = ratio_case.true_ratios(np.zeros((8, 3)), SPREADS, rng)
    delta[-1] = np.log([1.5, 1.0, 0.6])
    kept = ratio_case.infer(ratio_case.members_of(delta, ("",) * 8, 7))
    statuses = ("not contradicted",) * 7 + ("contradicted",)
    apart = ratio_case.infer(ratio_case.members_of(delta, ("",) * 8, 7, statuses))
    assert np.median(apart.eta[:, 3]) < np.median(kept.eta[:, 3])
    assert apart.shrinkage.outlier[-1] > 0.9 > kept.shrinkage.outlier[-1]
    assert stored.members.outlier_prior.max() == case.OUTLIERS.not_contradicted


def test_a_group_of_one_is_not_compared_and_nobody_is_lost() -> None:
    found = stored_form(cohort(groups=("control",) * 7 + ("treated",)), ())
    assert found.groups == ()
    assert len(found.member) == 8
    assert "the group 'treated' has one person" in found.notes
    assert any("'treated' has one person" in line for line in group_lines(found))
    assert len(draw_change_groups(found, cohort_title=TITLE).axes) == 6


def test_one_person_alone_is_answered() -> None:
    found = stored_form(cohort(groups=("treated",)), ())
    assert len(change_table(found)) == 6
    assert found.hyperparameter[0] == "median k0_kpa"


def test_it_is_said_in_sentences_and_read_back(stored: CohortPosterior, tmp_path: Path) -> None:
    path = tmp_path / "changes_groups.h5"
    stored.write(path, Provenance(""))
    again = CohortPosterior.read(path)
    lines = "\n".join(group_lines(again))
    assert "relaxation" in lines or "k_SR" in lines
    assert "control over treated: 1." in lines
    assert "that they differ is not told (higher with a probability of" in lines
    further = replace(again.population, group_factor=1.3 * again.population.group_factor)
    assert "control rose more than treated, or fell less, with a probability of 9" in "\n".join(
        group_lines(replace(again, population=further))
    )
    assert "P99." in lines
    opened = arviz.from_netcdf(str(path), engine="h5netcdf")
    assert opened.posterior["within"].sizes["member"] == len(GROUPS)
    assert len(draw_change_groups(again, cohort_title=TITLE).axes) == 9


def test_the_figure_explains_its_bands_and_shows_the_truth(stored: CohortPosterior) -> None:
    truth = np.tile(np.exp([0.1, 0.0, -0.2]), (len(GROUPS), 1))
    figure = draw_change_groups(stored, cohort_title=TITLE, truth=truth)
    assert_text_apart(figure)
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert {"90% of persons, treated", "90% of persons, control", "each alone", "truth"} <= set(said)
    assert "groups are compared with treated" in figure.get_suptitle()
    marks = [line for line in figure.axes[2].lines if line.get_marker() == "x"]
    assert marks[0].get_xdata() == pytest.approx(np.exp(-0.2))
    low, high = np.exp(np.log(figure.axes[0].get_xlim()))
    assert sum(low <= tick <= high for tick in figure.axes[0].get_xticks()) >= 3


def test_names_with_dollar_signs_are_drawn_as_they_are(stored: CohortPosterior) -> None:
    money = {name: rf"$\{name}$" for name in ("treated", "control")}  # no mathematics that is known
    named = replace(
        stored,
        member=tuple(rf"$\{name}$" for name in stored.member),
        group=tuple(money[name] for name in stored.group),
        reference_group=money[stored.reference_group],
        compared_group=tuple(money[name] for name in stored.compared_group),
    )
    figure = draw_change_groups(named, cohort_title=r"$\title$")
    figure.draw_without_rendering()
    assert r"\$\title\$" in figure.get_suptitle()


def test_persons_of_whom_too_few_draws_are_left_are_named(inferred: CohortResult) -> None:
    assert doubts((), inferred, 1.5) == ()
    (said,) = doubts((), inferred, 1e6)
    assert "s0 (" in said


def test_ratios_are_not_drawn_anew(inferred: CohortResult) -> None:
    with pytest.raises(ValueError, match="ratios of two visits are not drawn anew"):
        shrunken_prior(inferred.model, inferred.eta, 0)


def test_nobody_is_refused() -> None:
    with pytest.raises(ValueError, match="needs at least one person"):
        ratio_case.infer([])


NO_OUTLIERS = ratio_case.EFFORT.model_copy(
    update={"outliers": case.OUTLIERS.model_copy(update={"not_contradicted": 0.0})}
)
"""Without outliers the parameters are apart."""
AWAY = np.log([[2.0, 2.8, 0.4], [1.8, 2.4, 0.45]])
"""Mean log ratios of two groups, where the prior of a ratio is far from flat."""
OF_HYPERPARAMETERS = 0.16
"""Largest Kolmogorov-Smirnov distance of 200 from 500 effective draws, but for one in a thousand."""


def distance_from_quadrature() -> float:
    """Return the largest distance between the hyperparameters found and those by quadrature."""
    rng, group = np.random.default_rng(4), np.arange(12) % 2
    delta = ratio_case.true_ratios(AWAY[group], 2.0 * SPREADS, rng)
    measured = ratio_case.measured_visits(delta, 4)
    members = ratio_case.members_of(delta, [("a", "b")[one] for one in group], 4)
    design = design_of(members, covariates=())

    def evidence(j: int, mean: FloatArray, spread: FloatArray) -> FloatArray:
        found = np.empty_like(mean)
        for one in (0, 1):
            own = np.flatnonzero(group == one)
            grids = [on_a_grid(measured, person, j) for person in own]
            every = grids[0][0][::10]
            away = (every - mean[:, own[:1]]) / spread[:, None]
            population = np.exp(-0.5 * away**2)
            population /= population.sum(axis=1, keepdims=True)
            found[:, own] = np.log(population @ np.stack([each[1][::10] for each in grids], axis=1))
        return found

    prior = ratio_prior(design)
    known = separable.draw_eta(prior, design, evidence, 2000, rng, 120_000)
    own = infer_population(members, QUANTITY, NO_OUTLIERS, None, 1).exact.phi
    return max(float(ks_2samp(*pair).statistic) for pair in zip(own.T, known.T, strict=True))


@pytest.mark.slow(minutes=0.1)
def test_hyperparameters_are_those_by_quadrature() -> None:
    assert distance_from_quadrature() < OF_HYPERPARAMETERS


@pytest.mark.slow(minutes=0.1)
def test_without_the_division_by_the_prior_of_the_ratio_they_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(population_model, "log_density", lambda ratio, prior: -np.log(ratio).sum(axis=1))
    assert distance_from_quadrature() > 1.5 * OF_HYPERPARAMETERS


COHORTS = 60


def levels(cohorts: int) -> FloatArray:
    """Return where the truth lies in the draws of each hyperparameter, drawn from the hyperprior; (n, k)."""
    found = []
    for seed in range(cohorts):
        rng = np.random.default_rng(500 + seed)
        groups = ("a", "b") * 6
        blank = ratio_case.members_of(np.zeros((12, 3)), groups, 1)
        design = design_of(blank, covariates=())
        eta = draw_prior(ratio_prior(design), 1, rng)[0]
        mean = np.log(eta[:3]) + design.matrix @ np.log(eta[6:9])[None]
        delta = ratio_case.true_ratios(mean, eta[3:6], rng)
        inferred = ratio_case.infer(ratio_case.members_of(delta, groups, 500 + seed), seed)
        found.append((inferred.exact.phi < eta).mean(axis=0))
    return np.array(found)


@pytest.mark.exhaustive
def test_intervals_over_cohorts_hold_the_truth() -> None:
    level = levels(COHORTS)
    inside = ((level > 0.05) & (level < 0.95)).sum(axis=0)
    low, high = binom.ppf([0.0005, 0.9995], COHORTS, 0.9)
    assert ((inside >= low) & (inside <= high)).all()
    assert inside.mean() / COHORTS == pytest.approx(0.9, abs=0.04)
    p_values = [float(kstest(column, "uniform").pvalue) for column in level.T]
    assert min(p_values) > 0.01 / len(p_values)
