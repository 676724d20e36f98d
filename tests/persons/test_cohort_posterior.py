"""The posterior of a cohort from end to end, on persons whose posteriors are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import arviz
import hierarchy_case as case
import numpy as np
import pytest

from swesbi.artefacts import Provenance
from swesbi.persons.cohort.cohort import design_of
from swesbi.persons.cohort.infer import CohortResult, stored_form
from swesbi.persons.cohort.stored import (
    GROUP_FACTOR,
    GROUP_MEDIAN,
    CohortPosterior,
    hyperparameter_table,
    subject_table,
)
from swesbi.report.figures.cohort_posterior import draw_cohort_posterior
from swesbi.seeds import generator

TITLE = "virtual volunteers"
TRUTH = np.r_[
    [40.0, 6.0, 25.0], [0.2, 0.25, 0.2], [1.0] * 3, [1.0] * 3, [1.0] * 3, [1.0, 1.0, 0.35]
]  # medians, spreads, age, sex, heart rate, group b over a
STATUSES = ("not contradicted",) * 8 + ("doubtful", "contradicted")
GROUPS = "aabbaabbab"  # sexes alternate


@pytest.fixture(scope="module")
def inferred() -> CohortResult:
    rng = generator(3, "cohort")
    contexts = case.contexts(len(GROUPS), rng)
    outlier = np.array([case.OUTLIERS.of(status) for status in STATUSES])
    measured = case.draw_members(TRUTH, design_of(case.blank(contexts, GROUPS)), outlier, rng)
    members = case.members_of(measured, contexts, STATUSES, GROUPS)
    return case.infer(members, case.SETTINGS, case.redraw_of(measured), 5)


@pytest.fixture(scope="module")
def posterior(inferred: CohortResult) -> CohortPosterior:
    return stored_form(inferred, ("a person counts once",))


def read_back(posterior: CohortPosterior, path: Path) -> CohortPosterior:
    posterior.write(path, Provenance(""))
    return CohortPosterior.read(path)


def test_the_population_is_found(inferred: CohortResult) -> None:
    assert inferred.exact.converged
    low, high = np.quantile(inferred.exact.phi, [0.005, 0.995], axis=0)
    assert ((low < TRUTH) & (high > TRUTH)).all()
    assert (inferred.exact.phi[:, -1] < 1.0).mean() > 0.97
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


def test_the_file_reads_back_by_us_and_by_arviz(posterior: CohortPosterior, tmp_path: Path) -> None:
    path = tmp_path / "cohort_posterior.h5"
    again = read_back(posterior, path)
    assert again.groups == ("a", "b")
    assert np.array_equal(again.population.within, posterior.population.within)
    opened = arviz.from_netcdf(str(path), engine="h5netcdf")
    summary = arviz.summary(opened, var_names=["median", "spread", "group_factor"], kind="stats")
    assert len(summary) == 9
    assert opened.posterior["within"].sizes["member"] == len(GROUPS)
    assert np.isfinite(arviz.loo(opened, pointwise=False).elpd_loo)


def test_one_person_without_groups_and_covariates_is_stored_and_drawn(tmp_path: Path) -> None:
    context = case.contexts(1, np.random.default_rng(1))
    measured = case.Measured(np.log([[45.0, 5.0, 30.0]]), case.ERROR_SD[None])
    found = case.infer(case.members_of(measured, context), case.SETTINGS, None, 1)
    again = read_back(stored_form(found), tmp_path / "one.h5")
    assert (again.covariate, again.groups) == ((), ())
    assert "age does not vary over the cohort" in again.notes
    assert len(hyperparameter_table(again)) == 6
    draw_cohort_posterior(again, cohort_title=TITLE).draw_without_rendering()


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
    assert len(table) == 3 * (2 + 3 + 2 + 1)
    of_k_sr = table[table["parameter"] == "k_sr_per_s"].set_index("quantity")
    factor = of_k_sr.loc[GROUP_FACTOR]
    assert factor["of"] == "b over a"
    assert factor["median"] < 0.7
    assert factor["probability_above_1"] < 0.03
    medians = of_k_sr.loc[[GROUP_MEDIAN], "median"]
    assert medians.iloc[1] / medians.iloc[0] == pytest.approx(factor["median"], rel=0.1)
    assert len(subject_table(posterior)) == 3 * len(GROUPS)
