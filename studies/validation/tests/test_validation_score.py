"""What an answer covers, what a heart misses, and the tables that they add up to."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from other_hearts_case import HEART
from scipy.stats import beta, norm
from validation_case import VALIDATION, answer

from studies.validation import score
from studies.validation.score import (
    intervals,
    read_answers,
    refusal,
    to_dataset,
    truths,
    width_at_fixed_scale,
)
from studies.validation.table import samplers_table, validation_table
from swesbi import artefacts
from swesbi.report.tables.validation_outcomes import NOT_TESTED, QUANTITIES, TESTED

TITLES = {"a": "one", "e": "other"}
SCORE = VALIDATION.score


def test_intervals_are_quantiles_of_the_draws_that_have_a_beat() -> None:
    phi = np.column_stack([np.linspace(1.0, 1.0 + scale, 101) for scale in (1.0, 2.0, 4.0, 7.0, 9.0)])
    attained = np.linspace(1.0, 11.0, 101)
    found = intervals(phi, attained, None, 0.9)
    np.testing.assert_allclose(found.low, [1.5, 1.2, 1.05, 1.1])
    np.testing.assert_allclose(found.median, [6.0, 3.0, 1.5, 2.0])
    np.testing.assert_allclose(found.high, [10.5, 4.8, 1.95, 2.9])
    np.testing.assert_allclose(found.width_log_scale_fixed, np.log(found.high / found.low))
    without = np.where(attained > 6.0, np.nan, attained)
    np.testing.assert_allclose(intervals(phi, without, None, 0.9).median, [3.5, 2.0, 1.25, 1.5])
    assert np.isfinite(intervals(phi, without, phi[:, 4], 0.9).width_log_scale_fixed).all()


def test_the_width_at_a_fixed_scale_is_that_of_a_conditional_normal() -> None:
    """log x = 0.5 - 2 log q + e: sd 0.1 given q, sqrt(0.1^2 + (2 0.05)^2) without; log y has no part in q."""
    rng = np.random.default_rng(2)
    log_q, own, other = rng.standard_normal((3, 200_000)) * np.array([[0.05], [0.1], [0.2]])
    values = np.exp(np.column_stack([0.5 - 2.0 * log_q + own, other]))
    within = norm.ppf(0.95) - norm.ppf(0.05)
    found = width_at_fixed_scale(values, np.exp(log_q), 0.9)
    np.testing.assert_allclose(found, within * np.array([0.1, 0.2]), rtol=0.01)
    low, high = np.quantile(np.log(values[:, 0]), [0.05, 0.95])
    assert high - low == pytest.approx(within * np.hypot(0.1, 0.1), rel=0.01)


def test_a_posterior_without_a_beat_is_refused() -> None:
    with pytest.raises(ValueError, match="no draw of the posterior has a periodic beat"):
        intervals(np.ones((3, 14)), np.full(3, np.nan), None, 0.9)


def test_truths_are_in_the_order_of_the_quantities_and_missing_ones_empty() -> None:
    assert QUANTITIES == ("attained_kpa", "k_sr_per_s", "k0_kpa", "k_atp_per_s")
    assert truths(HEART).tolist() == [40.0, 30.0, 60.0, 6.0]
    np.testing.assert_array_equal(truths(replace(HEART, theta=None)), [40.0, 30.0, np.nan, np.nan])
    other = replace(HEART, theta=None, k_sr_per_s=None)
    np.testing.assert_array_equal(truths(other), [40.0, np.nan, np.nan, np.nan])


@pytest.mark.parametrize(
    ("truth", "missed"),
    [
        ((40.0, 30.0, 60.0, 6.0), False),
        ((31.0, 30.0, 60.0, 6.0), True),
        ((40.0, 38.0, 60.0, 6.0), True),
        ((40.0, 30.0, 600.0, 60.0), False),
        ((40.0, float("nan"), float("nan"), float("nan")), False),
        ((51.0, float("nan"), float("nan"), float("nan")), True),
    ],
)
def test_a_heart_is_missed_by_attained_stiffness_and_k_sr_alone(
    truth: tuple[float, float, float, float], missed: bool
) -> None:
    assert answer(truth=truth).missed is missed


def test_answers_are_stored_whole(tmp_path: Path) -> None:
    made = [answer(0), answer(1, "strained", by_mcmc=True), refusal(2, HEART, 3, "ivsd_cm = 2 is outside")]
    path = tmp_path / "a.h5"
    artefacts.save(path, to_dataset(made), artefacts.Provenance(score.KIND))
    for one, other in zip(read_answers(path), made, strict=True):
        assert one.context == other.context
        np.testing.assert_equal(asdict(one), asdict(other))


def test_the_table_counts_verdicts_coverage_and_misses() -> None:
    good = [answer(number) for number in range(30)]
    missed = [answer(30 + number, truth=(20.0, 30.0, 60.0, 6.0)) for number in range(10)]
    strained = [answer(40 + number, "strained", truth=(40.0, 10.0, 60.0, 6.0)) for number in range(8)]
    refused = [refusal(48 + number, HEART, 1, "too thick") for number in range(2)]
    made = {"a": [*good, *missed, *strained, *refused]}
    table = validation_table(made, TITLES, SCORE).set_index("quantity")
    assert list(table.index) == list(QUANTITIES)
    assert set(table["generator"]) == {"a: one"}
    row = table.loc["attained_kpa"]
    assert (row["n"], row["n_not_contradicted"], row["tested"]) == (50, 40, TESTED)
    shares = row[["not_contradicted", "strained", "contradicted", "refused"]]
    assert shares.tolist() == pytest.approx([0.8, 0.16, 0.0, 0.04])
    assert row["coverage"] == pytest.approx(38 / 48)
    assert row["coverage_not_contradicted"] == pytest.approx(0.75)
    assert table["missed_not_contradicted"].tolist() == pytest.approx([0.25] * 4)
    assert table.loc["k_sr_per_s", "coverage"] == pytest.approx(40 / 48)
    assert table.loc["k_sr_per_s", "coverage_not_contradicted"] == 1.0
    assert row["coverage_low"] == pytest.approx(beta.ppf(0.025, 38, 11))
    assert row["coverage_high"] == pytest.approx(beta.ppf(0.975, 39, 10))
    assert row["bias_log"] == pytest.approx(10 / 48 * np.log(2.0))
    assert row["width_log"] == pytest.approx(np.log(1.25 / 0.8))
    assert row["width_log_scale_fixed"] == 0.25


def test_widths_are_medians_over_the_answered() -> None:
    made = [answer(number, high=high, width_fixed=high) for number, high in enumerate((1.1, 1.2, 2.0))]
    row = validation_table({"a": [*made, refusal(3, HEART, 0, "")]}, TITLES, SCORE).iloc[0]
    assert row["width_log"] == pytest.approx(np.log(1.2 / 0.8))
    assert row["width_log_scale_fixed"] == 1.2


@pytest.mark.parametrize(("good", "tested"), [(29, NOT_TESTED), (30, TESTED)])
def test_a_generator_with_fewer_than_thirty_hearts_not_contradicted_is_not_tested(
    good: int, tested: str
) -> None:
    made = [answer(number) for number in range(good)]
    made += [answer(good + number, "contradicted") for number in range(40)]
    row = validation_table({"a": made}, TITLES, SCORE).iloc[0]
    assert row["tested"] == tested
    of_not_contradicted = row[
        ["coverage_not_contradicted", "missed_not_contradicted", "coverage_not_contradicted_low"]
    ]
    assert of_not_contradicted.isna().all() == (tested == NOT_TESTED)
    assert row["coverage"] == 1.0


def test_what_a_generator_has_no_truth_of_has_no_row() -> None:
    nan = float("nan")
    made = {"a": [answer()], "e": [answer(truth=(40.0, nan, nan, nan))]}
    table = validation_table(made, TITLES, SCORE)
    assert table.loc[table["generator"] == "e: other", "quantity"].tolist() == ["attained_kpa"]
    assert len(table) == 5


def test_a_generator_that_is_refused_throughout_has_a_row_without_numbers() -> None:
    table = validation_table({"a": [refusal(0, HEART, 0, "too thick")]}, TITLES, SCORE)
    assert table["refused"].tolist() == [1.0] * 4
    assert table[["coverage", "bias_log", "width_log_scale_fixed", "coverage_low"]].isna().all(axis=None)
    samplers = samplers_table({"a": [refusal(0, HEART, 0, "")]}, TITLES)
    assert samplers["efficiency"].isna().all()


def test_samplers_are_counted_by_generator() -> None:
    made = [answer(0), answer(1, by_mcmc=True), answer(2), refusal(3, HEART, 4, "too thick")]
    row = samplers_table({"a": made}, TITLES).iloc[0]
    assert (row["hearts"], row["refused"], row["redrawn"]) == (4, 1, 4)
    assert row["efficiency"] == pytest.approx(0.51)
    assert row["by_mcmc"] == pytest.approx(1 / 3)
    assert row["not_converged"] == 0.0
