"""The posterior of a cohort from end to end, on persons whose posteriors are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import arviz
import hierarchy_case as case
import numpy as np
import pytest
from matplotlib.figure import Figure

from swesbi.artefacts import Provenance
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import design_of
from swesbi.persons.cohort.hyperprior import hyperprior_of
from swesbi.persons.cohort.infer import CohortResult
from swesbi.persons.cohort.stored import CohortPosterior, stored_form
from swesbi.persons.cohort.table import (
    COLUMNS,
    GROUP_FACTOR,
    GROUP_MEDIAN,
    SUBJECT_COLUMNS,
    hyperparameter_table,
    subject_table,
)
from swesbi.prior import PriorSettings
from swesbi.report.figures.cohort_posterior import draw_cohort_posterior
from swesbi.seeds import generator

PERSONS = 10
TITLE = "virtual volunteers"
TRUTH = np.r_[
    [40.0, 6.0, 25.0], [0.2, 0.25, 0.2], [1.0] * 3, [1.0] * 3, [1.0] * 3, [1.0, 1.0, 0.35]
]  # medians, spreads, age, sex, heart rate, group b over a
STATUSES = ("not contradicted",) * 8 + ("doubtful", "contradicted")
GROUPS = "aabbaabbab"  # sexes alternate


def infer(groups: str = GROUPS, seed: int = 5) -> CohortResult:
    rng = generator(3, "cohort")
    contexts = case.contexts(PERSONS, rng)
    blank = [
        case.Member(context, "not contradicted", group.strip(), np.empty((0, 3)), np.empty(0))
        for context, group in zip(contexts, GROUPS, strict=True)
    ]
    outlier = np.array([case.OUTLIERS.of(status) for status in STATUSES])
    _, measured = case.draw_members(TRUTH, design_of(blank), outlier, rng)
    stripped = [group.strip() for group in groups]
    members = case.members_of(measured, contexts, STATUSES, stripped, 4000)

    def redraw(subject: str, prior: PriorSettings, stream: int) -> case.FloatArray:
        return measured.posterior(int(subject[1:]), prior, case.SETTINGS.draws, stream)

    return case.infer(members, case.SETTINGS, redraw, seed)


@pytest.fixture(scope="module")
def inferred() -> CohortResult:
    return infer()


@pytest.fixture(scope="module")
def posterior(inferred: CohortResult) -> CohortPosterior:
    return stored_form(inferred, ("a person counts once",))


def write(posterior: CohortPosterior, path: Path) -> Path:
    posterior.write(path, Provenance(""))
    return path


def test_the_population_is_found(inferred: CohortResult) -> None:
    assert inferred.exact.converged
    design = design_of(inferred.members)
    assert inferred.prior == hyperprior_of(design, case.THETA_PRIOR.parameters, case.HYPERPRIOR)
    low, high = np.quantile(inferred.exact.phi, [0.005, 0.995], axis=0)
    assert ((low < TRUTH) & (high > TRUTH)).all()
    factor = inferred.exact.phi[:, -1]
    assert (factor < 1.0).mean() > 0.97
    assert inferred.shrinkage.effective.min() > case.SETTINGS.least_effective


def test_subjects_not_contradicted_lean_on_the_population_and_outliers_do_not(
    posterior: CohortPosterior,
) -> None:
    subjects = posterior.members
    assert subjects.outlier_prior.tolist() == [0.02] * 8 + [0.2, 0.9]
    assert subjects.outlier_posterior[-1] > subjects.outlier_posterior[:8].max()
    width = np.log(subjects.after[:, 2] / subjects.after[:, 0]).mean(axis=1)
    alone = np.log(subjects.before[:, 2] / subjects.before[:, 0]).mean(axis=1)
    assert (width / alone)[:8].mean() < 0.95


def test_the_same_seed_gives_the_same_bytes(inferred: CohortResult, tmp_path: Path) -> None:
    first = write(stored_form(inferred), tmp_path / "first.h5")
    second = write(stored_form(infer()), tmp_path / "second.h5")
    assert first.read_bytes() == second.read_bytes()


def test_the_file_reads_back_by_us_and_by_arviz(posterior: CohortPosterior, tmp_path: Path) -> None:
    path = write(posterior, tmp_path / "cohort_posterior.h5")
    again = CohortPosterior.read(path)
    assert again.member == posterior.member
    assert again.groups == ("a", "b")
    assert again.notes.startswith("a person counts once")
    assert np.array_equal(again.population.within, posterior.population.within)
    opened = arviz.from_netcdf(str(path), engine="h5netcdf")
    assert {"posterior", "sample_stats", "log_likelihood", "constant_data"} <= set(opened.groups())
    summary = arviz.summary(opened, var_names=["median", "spread", "group_factor"], kind="stats")
    assert len(summary) == 9
    assert opened.posterior["within"].sizes["member"] == PERSONS
    loo = arviz.loo(opened, pointwise=False)
    assert np.isfinite(loo.elpd_loo)
    assert CohortPosterior.load(path)[0]["/"]["hyperparameter"].values.size == 18


def test_without_groups_and_covariates_the_file_has_none(tmp_path: Path) -> None:
    context = case.contexts(1, np.random.default_rng(1))
    measured = case.Measured(np.log([[45.0, 5.0, 30.0]]), case.ERROR_SD[None])
    members = case.members_of(measured, context, ["not contradicted"], [""], 4000)
    posterior = stored_form(case.infer(members, case.SETTINGS, None, 1))
    again = CohortPosterior.read(write(posterior, tmp_path / "one.h5"))
    assert again.covariate == ()
    assert again.groups == ()
    assert again.population.covariate_factor.shape[2] == 0
    assert "age does not vary over the cohort" in again.notes
    assert isinstance(draw_cohort_posterior(again, cohort_title=TITLE), Figure)
    assert len(hyperparameter_table(again)) == 6


def test_groups_with_dollar_signs_are_drawn_as_they_are(posterior: CohortPosterior) -> None:
    money = {"a": r"$\first$", "b": r"$\other$"}
    named = replace(
        posterior,
        group=tuple(money[name] for name in posterior.group),
        reference_group=money["a"],
        compared_group=(money["b"],),
    )
    draw_cohort_posterior(named, cohort_title=TITLE).draw_without_rendering()


def test_tables_have_a_row_each(posterior: CohortPosterior) -> None:
    table = hyperparameter_table(posterior)
    assert tuple(table.columns) == COLUMNS
    assert len(table) == 3 * (2 + 3 + 2 + 1)
    row = table[(table["quantity"] == GROUP_FACTOR) & (table["parameter"] == "k_sr_per_s")].iloc[0]
    assert row["of"] == "b over a"
    assert row["median"] < 0.7
    assert row["probability_above_1"] < 0.03
    medians = table[(table["quantity"] == GROUP_MEDIAN) & (table["parameter"] == "k_sr_per_s")]["median"]
    assert medians.iloc[1] / medians.iloc[0] == pytest.approx(row["median"], rel=0.1)
    subjects = subject_table(posterior)
    assert tuple(subjects.columns) == SUBJECT_COLUMNS
    assert len(subjects) == PERSONS * len(THETA_NAMES)
