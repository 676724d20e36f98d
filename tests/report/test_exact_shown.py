"""Exact posteriors as files and tables: verdicts, truth."""

from __future__ import annotations

from pathlib import Path

import evaluation_cases
import numpy as np
import pytest
from evaluation_cases import TRUE_THETA
from exact_shown import phi, result, verdict, write_posterior

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.typed import Place
from swesbi.checks.truths import Truths
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.report.study_tables import TRUTH_COLUMNS, beside_the_truth
from swesbi.verdict.summary import is_exact, verdict_numbers


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
    places = {Place("calibrated", name): name for name in ("A", "F", "recorded")}
    posteriors = dict.fromkeys(places, posterior_of(5.0, 60.0))
    verdicts = {place: verdict("F" if name == "F" else "A") for place, name in places.items()}
    truths = {name: np.array(TRUE_THETA[name], float) for name in "AF"}
    table = beside_the_truth(posteriors, verdicts, truths)
    assert tuple(table.columns) == TRUTH_COLUMNS
    assert table["subject"].tolist() == ["A"] * 3 + ["F"] * 3
    assert table["inside"].tolist() == [True, True, True, None, None, None]
    assert table["low"].isna().tolist() == [False] * 3 + [True] * 3
    of_a = Place("x", "A")
    narrow = beside_the_truth(
        {of_a: posterior_of(5.0, 40.0)}, {of_a: verdict("A")}, {"A": np.array([58, 6, 28])}
    )
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
