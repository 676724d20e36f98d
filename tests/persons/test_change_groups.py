"""What has changed in groups, on persons whose posteriors are known in closed form."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path
from types import SimpleNamespace

import arviz
import hierarchy_case as case
import numpy as np
import pytest
import ratio_case
from figure_text import assert_text_apart
from scipy.stats import norm
from test_compare_command import stored as change_of_one

from swesbi.artefacts import Provenance
from swesbi.base.arrays import FloatArray
from swesbi.persons.change.groups import change_in_groups, doubts, group_lines, verdict_of_pair
from swesbi.persons.change.stored import OnePerson, StoredChange
from swesbi.persons.cohort import model as population_model
from swesbi.persons.cohort.cohort import design_of, hyperprior_of
from swesbi.persons.cohort.infer import CohortResult, of_ratios, stored_form
from swesbi.persons.cohort.model import CohortModel, RatioPrior, log_density, shrunken_prior
from swesbi.persons.cohort.stored import (
    DIFFERENCE,
    RATIO,
    RATIO_SPREAD,
    CohortPosterior,
    change_table,
    person_table,
)
from swesbi.report.figures.cohort_posterior import draw_change_groups
from swesbi.study.compare import GROUP_OUTPUTS, save_groups
from swesbi.verdict.verdict import STATUSES, Status

PRIOR = RatioPrior(case.THETA_PRIOR)
EFFECT = np.log([1.1, 1.0, 0.75])
SPREADS = np.array([0.06, 0.08, 0.08])
GROUPS = ("treated", "control") * 7
TITLE = "persons without hearts"
QUANTITY = of_ratios(case.THETA_PRIOR, ratio_case.SETTINGS.hyperprior)
TWO_PERSONS = OnePerson(-3.0, -2.0, 0.01, 0.05, 4.0)


def no_division(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lose the division by the prior of a ratio."""
    monkeypatch.setattr(population_model, "log_density", lambda ratio, prior: -np.log(ratio).sum(axis=1))


def of_two_visits(j: int, *at_visit: Callable[[FloatArray], FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return log ratios of a parameter and their density under the prior of visits with these likelihoods."""
    prior = case.THETA_PRIOR.parameters[j]
    grid = np.linspace(np.log(prior.low), np.log(prior.high), 2401)
    step, density = grid[1] - grid[0], norm.pdf(grid, np.log(prior.centre), prior.log_sd)
    density /= np.trapezoid(density, grid)
    earlier, later = (density * likelihood(grid) for likelihood in at_visit)
    return step * np.arange(-2400, 2401), np.convolve(later, earlier[::-1]) * step


def test_the_prior_of_a_ratio_is_that_of_two_visits() -> None:
    at_one = 0.0
    for j in range(3):
        delta, density = of_two_visits(j, np.ones_like, np.ones_like)
        inside = np.abs(delta) < 0.9 * delta[-1]
        rows = np.ones((inside.sum(), 3))
        rows[:, j] = np.exp(delta[inside])
        found = log_density(rows, PRIOR) + delta[inside] - log_density(np.ones((1, 3)), PRIOR)
        assert found == pytest.approx(np.log(density[inside] / density[2400]), abs=0.01)
        at_one += np.log(density[2400])
    assert log_density(np.ones((1, 3)), PRIOR)[0] == pytest.approx(at_one, abs=0.001)
    assert log_density(np.array([[1.0, 16.0, 1.0]]), PRIOR)[0] == -np.inf


def cohort(groups: tuple[str, ...] = GROUPS) -> CohortResult:
    mean = np.where((np.array(groups) == "treated")[:, None], EFFECT, 0.0)
    ratios = ratio_case.true_ratios(mean, SPREADS, np.random.default_rng(3))
    return ratio_case.infer(ratio_case.members_of(ratios, groups, 3), 3)


@pytest.fixture(scope="module")
def inferred() -> CohortResult:
    return cohort()


@pytest.fixture(scope="module")
def stored(inferred: CohortResult) -> CohortPosterior:
    return stored_form(inferred, ("left out: P99",))


def test_groups_differ_by_what_was_put_in(stored: CohortPosterior) -> None:
    assert stored.converged
    assert stored.groups == ("treated", "control")
    table = change_table(stored)
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
    assert len(table) == 3 * len(GROUPS)
    width = np.log(table["high_1"] / table["low_1"])
    assert (width / np.log(table["alone_high_1"] / table["alone_low_1"])).mean() < 0.9
    assert (table["effective_draws"] > 5).all()


def evidence_on_a_grid(measured: tuple[case.Measured, case.Measured], eta: FloatArray) -> float:
    """Return log p(data | eta) / p(data) of the first person, by quadrature over both visits."""
    found = 0.0
    for j in range(3):
        delta, prior = of_two_visits(j, np.ones_like, np.ones_like)
        _, both = of_two_visits(j, *(norm(one.log_theta[0, j], one.error_sd[0, j]).pdf for one in measured))
        population = norm.pdf(delta, np.log(eta[j]), eta[3 + j])
        found += np.log(population @ (both / prior) / population.sum() * prior.sum() / both.sum())
    return float(found)


@pytest.mark.parametrize(
    ("ratio", "eta"),
    [
        ([1.05, 0.9, 0.8], [[1.0, 0.9, 0.85, 0.1, 0.15, 0.12], [1.1, 1.4, 1.2, 0.2, 0.3, 0.2]]),
        # where the prior of a ratio is far from flat
        ([2.0, 2.8, 0.4], [[2.0, 2.6, 0.42, 0.1, 0.15, 0.12], [1.7, 2.2, 0.5, 0.2, 0.3, 0.2]]),
    ],
)
def test_the_evidence_of_a_person_is_that_by_quadrature(
    ratio: list[float], eta: list[list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    delta, rows = np.log([ratio]), np.array(eta)
    members = ratio_case.members_of(delta, ("",), 5, draws=40_000)
    design, draws = design_of(members, covariates=()), case.equal_draws([members[0].theta])
    alone = population_model.PriorAlone(hyperprior_of(design, QUANTITY.median, QUANTITY.hyperprior))
    model = CohortModel(alone, draws, design.matrix, np.zeros(1), PRIOR)
    expected = [evidence_on_a_grid(ratio_case.measured_visits(delta, 5), row) for row in rows]
    assert model.log_likelihood(rows) == pytest.approx(expected, abs=0.1)
    no_division(monkeypatch)
    assert np.abs(replace(model).log_likelihood(rows) - expected).min() > 1.0


def test_a_group_of_one_is_not_compared_and_nobody_is_lost() -> None:
    found = stored_form(cohort(groups=("control",) * 7 + ("treated",)))
    assert found.groups == ()
    assert len(found.member) == 8
    assert any("'treated' has one person" in line for line in group_lines(found))
    assert len(draw_change_groups(found, cohort_title=TITLE).axes) == 6
    assert len(change_table(stored_form(cohort(groups=("treated",))))) == 6  # one person alone


def test_it_is_read_back_and_says_who_rose_more(stored: CohortPosterior, tmp_path: Path) -> None:
    path = tmp_path / "changes_groups.h5"
    stored.write(path, Provenance(""))
    again = CohortPosterior.read(path)
    lines = "\n".join(group_lines(again))
    assert "control over treated: 1." in lines
    assert "that they differ is not told (higher with a probability of" in lines
    assert "P99." in lines
    for factor, said in ((1.3, "control rose more than treated"), (0.5, "control rose less than treated")):
        moved = replace(again.population, group_factor=factor * again.population.group_factor)
        assert said in "\n".join(group_lines(replace(again, population=moved)))
    opened = arviz.from_netcdf(str(path), engine="h5netcdf")
    assert opened.posterior["within"].sizes["member"] == len(GROUPS)


def test_the_figure_shows_the_truth_and_names_with_dollar_signs_as_they_are(stored: CohortPosterior) -> None:
    truth = np.tile(np.exp([0.1, 0.0, -0.2]), (len(GROUPS), 1))
    figure = draw_change_groups(stored, cohort_title=TITLE, truth=truth)
    assert_text_apart(figure)
    assert len(figure.axes) == 9
    marks = [line for line in figure.axes[2].lines if line.get_marker() == "x"]
    assert marks[0].get_xdata() == pytest.approx(np.exp(-0.2))
    low, high = figure.axes[0].get_xlim()
    assert sum(low <= tick <= high for tick in figure.axes[0].get_xticks()) >= 3
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


def changes() -> list[StoredChange]:
    """Changes of eight persons; the last one's recordings are of two."""
    rng = np.random.default_rng(2)
    found = []
    for number in range(8):
        draws = 20.0 * np.exp(0.05 * rng.standard_normal((2, 600, 4)))
        draws[1, :, 2] *= 0.7 if number % 2 else 1.0
        verdict = np.array(["not contradicted", "not contradicted" if number else "uninformative"])
        one = replace(change_of_one(), person=f"P{number}", verdict=verdict)
        found.append(replace(one, phi=draws[:, :, :2], quantities=draws))
    return [*found[:-1], replace(found[-1], one_person=TWO_PERSONS)]


@pytest.mark.parametrize(("good", "bad"), [*combinations_with_replacement(STATUSES, 2)])
def test_a_pair_has_the_worse_verdict_of_both_visits(good: Status, bad: Status) -> None:
    one = replace(change_of_one(), verdict=np.array([good, bad]))
    assert verdict_of_pair(one) == verdict_of_pair(replace(one, verdict=one.verdict[::-1])) == bad
    assert verdict_of_pair(replace(one, one_person=TWO_PERSONS)) == "contradicted"
    assert verdict_of_pair(replace(one, converged=False)) == "contradicted"


def test_all_of_it_is_inferred_written_and_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    context = case.contexts(1, np.random.default_rng(1))[0]
    made = change_in_groups(
        changes(),
        [SimpleNamespace(context=context)] * 8,
        prior=case.THETA_PRIOR,
        change_groups=ratio_case.SETTINGS.model_copy(update={"draws": 600}),
        cohort_posterior=ratio_case.EFFORT,
        groups={f"P{number}": "treated" if number % 2 else "control" for number in range(8)},
        left_out=(),
        seed=1,
    )
    with caplog.at_level(logging.INFO, logger="swesbi"):
        save_groups(made, tmp_path, Provenance(""), "made-up persons")
    assert {path.name for path in tmp_path.iterdir()} == set(GROUP_OUTPUTS)
    found = CohortPosterior.read(tmp_path / GROUP_OUTPUTS[0])
    assert found.groups == ("control", "treated")
    factor = found.population.group_factor[0, :, 0, 2]
    assert np.quantile(factor, 0.05) < 0.7 < np.quantile(factor, 0.95)
    assert found.verdict[0] == "uninformative"
    outliers = [case.OUTLIERS.not_contradicted, case.OUTLIERS.contradicted]
    assert found.members.outlier_prior[[0, -1]].tolist() == outliers
    assert "both recordings are not of one person: P7" in "\n".join(caplog.messages)


def test_ratios_are_not_drawn_anew(inferred: CohortResult) -> None:
    with pytest.raises(ValueError, match="ratios of two visits are not drawn anew"):
        shrunken_prior(inferred.model, inferred.eta, 0)
