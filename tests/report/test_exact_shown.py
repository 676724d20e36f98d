"""Exact posteriors and noisy predictive checks as figures and tables: no text on text, verdicts, truth."""

from __future__ import annotations

from pathlib import Path

import evaluation_cases
import numpy as np
import pytest
from evaluation_cases import TITLE, TRUE_THETA
from exact_shown import PRIOR, panel, phi, predictive_panel, result, verdict, write_posterior
from figure_text import assert_text_apart, text_boxes
from matplotlib.figure import Figure

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.typed import Place
from swesbi.checks.truths import Truths
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.report.figures.posterior import draw_exact_posteriors
from swesbi.report.figures.posterior_subject import draw_exact_subject
from swesbi.report.figures.predictive import draw_cohort_checks, draw_subject_check
from swesbi.report.study_tables import TRUTH_COLUMNS, beside_the_truth, truth_table
from swesbi.verdict.summary import is_exact, verdict_numbers

MANY = [f"patient-{number:03d}" for number in range(14)]


@pytest.fixture(scope="module")
def drawn() -> dict[str, Figure]:
    return {
        "cohort": draw_exact_posteriors([panel(name) for name in "ABCDEF"], PRIOR, TITLE),
        "cohort-one": draw_exact_posteriors([panel("F", truth=False)], PRIOR, TITLE),
        "cohort-many": draw_exact_posteriors([panel(name, truth=False) for name in MANY], PRIOR, TITLE),
        "A": draw_exact_subject(panel("A"), PRIOR, TITLE),
        "F": draw_exact_subject(panel("F", truth=False), PRIOR, TITLE),
        "ppc": draw_cohort_checks([predictive_panel(name) for name in "ABCDEF"], TITLE),
        "ppc-D": draw_subject_check(predictive_panel("D"), TITLE),
        "ppc-F": draw_subject_check(predictive_panel("F"), TITLE),
    }


SHOWN = ["cohort", "cohort-one", "cohort-many", "A", "F", "ppc", "ppc-D", "ppc-F"]


@pytest.mark.parametrize("name", SHOWN)
def test_text_stands_apart_and_names_the_cohort(drawn: dict[str, Figure], name: str) -> None:
    assert_text_apart(drawn[name])
    assert any(TITLE in text for text, _ in text_boxes(drawn[name]))


def test_the_reliability_of_the_weights_is_that_of_the_files(drawn: dict[str, Figure]) -> None:
    shapes, efficiencies = drawn["cohort"].axes[-2:]
    assert [line.get_ydata()[0] for line in efficiencies.lines] == pytest.approx([82.0] * 5 + [2.0])
    assert sum(line.get_marker() == "^" for line in shapes.lines) == 1, "an infinite k-hat is off the axis"


def test_verdicts_of_both_kinds_are_read_alike() -> None:
    exact, plain = verdict("D"), evaluation_cases.verdict("A")
    assert (is_exact(exact), is_exact(plain)) == (True, False)
    assert (exact.status, plain.status) == ("doubtful", "prior-supported")
    read = [verdict("A"), exact, plain, verdict("F"), evaluation_cases.verdict("E", False)]
    assert [each.may_be_read for each in read] == [True, True, True, False, False]
    assert verdict_numbers(exact) == ("residuals, p < 0.001",)
    assert verdict_numbers(plain)[1] == "max |z| = 1.80"


def test_what_is_shown_is_what_was_written(tmp_path: Path) -> None:
    path, draws = tmp_path / "posterior.h5", phi("A", 300)
    write_posterior(path, draws, "A")
    found = ExactPosterior.read(path)
    np.testing.assert_array_equal(found.phi, draws)
    np.testing.assert_array_equal(Posterior.read(path).theta, draws[:, :3])
    assert (found.sampler, found.k_hat, found.efficiency, found.by_mcmc) == ("importance", 0.2, 0.8, False)
    assert np.isnan(found.largest_r_hat)
    assert result("F").by_mcmc


def posterior_of(low: float, high: float) -> Posterior:
    interval = np.array([[low, high]] * 3)
    median = interval.mean(axis=1)
    empty = np.empty((0, 3))
    return Posterior(empty, empty, np.empty(0, bool), median, interval, 0.9, np.eye(3), ("x",), np.zeros(1))


def test_the_truth_table_counts_what_lies_inside_and_leaves_out_the_contradicted() -> None:
    answers = [
        ("calibrated", "A", posterior_of(5.0, 60.0), verdict("A")),
        ("calibrated", "F", posterior_of(5.0, 60.0), verdict("F")),
        ("calibrated", "recorded", posterior_of(5.0, 60.0), verdict("A")),
    ]
    table = truth_table(answers, {name: np.array(TRUE_THETA[name], float) for name in "AF"})
    assert tuple(table.columns) == TRUTH_COLUMNS
    assert table["subject"].tolist() == ["A"] * 3 + ["F"] * 3
    assert table["inside"].tolist() == [True, True, True, None, None, None]
    assert table["low"].isna().tolist() == [False] * 3 + [True] * 3
    narrow = truth_table([("x", "A", posterior_of(5.0, 40.0), verdict("A"))], {"A": np.array([58, 6, 28])})
    assert narrow["inside"].tolist() == [False, True, True]


def test_every_experiment_stands_beside_the_truth(tmp_path: Path) -> None:
    posteriors, verdicts = {}, {}
    for name in "AF":
        write_posterior(tmp_path / f"{name}.h5", phi(name, 300), name)
        posteriors[Place("calibrated", name)] = Posterior.read(tmp_path / f"{name}.h5")
        verdicts[Place("calibrated", name)] = verdict(name)
    source = tmp_path / "truth.csv"
    source.write_text("subject,k0_kpa,k_atp_per_s,k_sr_per_s\nA,58,6,280\nF,60,80,30\n")
    table = beside_the_truth(posteriors, verdicts, Truths.read(source))
    own = table[table["subject"] == "A"]
    assert own["inside"].astype(str).tolist() == ["True", "True", "False"]
    assert table[table["subject"] == "F"]["low"].isna().all()
    assert set(table["status"]) == {"not contradicted", "contradicted"}


def test_a_broken_file_of_true_parameters_is_named(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    path.write_text("subject,k0_kpa\nA,58\n")
    with pytest.raises(ArtefactError, match="lacks the columns k_atp_per_s, k_sr_per_s"):
        Truths.read(path)
