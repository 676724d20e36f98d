"""What an answer covers, what a heart misses, and the tables that they add up to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import beta, norm
from validation_case import CONTEXT, HEART, VALIDATION, answer, recorded, truth

from studies.validation.score import intervals, refusal, truths, width_at_fixed_scale
from studies.validation.table import samplers_table, validation_table
from swesbi.base.arrays import FloatArray
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.parameters import ISOMETRIC, THETA_NAMES
from swesbi.report.tables.validation import (
    NOT_TESTED,
    POOLED_ALL,
    POOLED_TOGETHER,
    QUANTITIES,
    TESTED,
)

TITLES = {"a": "one", "e": "other"}
SCORE = VALIDATION.score


@dataclass(frozen=True)
class Curves:
    """A model whose bonds have a bell as high as theta's first, of which half is shown; 4 is passive."""

    recording: SpeedRecording
    scale: FloatArray | None = None
    failed: int = 0

    def simulate(self, phi: FloatArray) -> Beats:
        phase = np.arange(100) / 100.0
        bonds = phi[:, :1] * np.exp(-0.5 * ((phase - 0.4) / 0.1) ** 2)
        bonds[len(phi) - self.failed :] = np.nan
        return cast(Beats, SimpleNamespace(cycle_phase=phase, active_stiffness_kpa=bonds))

    def parts(self, phi: FloatArray, cycles: Beats) -> tuple[FloatArray, FloatArray]:
        return np.full_like(cycles.active_stiffness_kpa, 4.0), 0.5 * cycles.active_stiffness_kpa

    def activation_duration_s(self, phi: FloatArray) -> FloatArray:
        return np.full(len(phi), 0.05)

    def speed_scale(self, phi: FloatArray) -> FloatArray:
        return np.ones(len(phi)) if self.scale is None else self.scale


def curves(scale: FloatArray | None = None, failed: int = 0) -> SpeedModel:
    nothing = np.empty(0)
    recording = SpeedRecording(CONTEXT, nothing, nothing, nothing, np.empty((0, 0)))
    return cast(SpeedModel, Curves(recording, scale, failed))


def test_intervals_are_quantiles_of_the_draws_that_have_a_beat() -> None:
    phi = np.column_stack([np.linspace(10.0, 10.0 + 10.0 * scale, 101) for scale in (1.0, 2.0, 4.0, 7.0)])
    found = intervals(curves(), phi, 0.9)
    medians = dict(zip(QUANTITIES, found.median, strict=True))
    assert (medians["k0_kpa"], medians["k_atp_per_s"], medians["k_sr_per_s"]) == (15.0, 20.0, 30.0)
    k_0, k_atp = np.array([15.0, 10.5, 19.5, 12.5]), np.array([20.0, 11.0, 29.0, 15.0])
    isometric = k_0 * (1.0 - np.exp(-0.05 * k_atp))
    assert (medians[ISOMETRIC], medians["peak_active_kpa"]) == pytest.approx((isometric[0], 7.5))
    half_ms = 1e3 * CONTEXT.period_s * (0.4 + 0.1 * np.sqrt(2.0 * np.log(2.0)))
    assert medians["half_active_ms"] == pytest.approx(half_ms, rel=0.01)
    assert medians["peak_kpa"] == pytest.approx(11.5, abs=1e-3)
    # full width at half height of a bell of a tenth of the cycle
    full_width = 1e3 * CONTEXT.period_s * 0.1 * np.sqrt(8.0 * np.log(2.0))
    assert medians["duration_ms"] == pytest.approx(full_width, rel=0.01)
    column = QUANTITIES.index(ISOMETRIC)
    assert (found.low[column], found.high[column]) == pytest.approx(isometric[1:3])
    np.testing.assert_allclose(found.width_log_scale_fixed, np.log(found.high / found.low), atol=1e-12)
    of_half = intervals(curves(failed=50), phi, 0.9)
    assert of_half.median[column] == pytest.approx(isometric[3])
    assert np.isfinite(intervals(curves(phi[:, 3], 50), phi, 0.9).width_log_scale_fixed).all()


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
        intervals(curves(failed=3), np.full((3, 14), 5.0), 0.9)


def test_truths_are_in_the_order_of_the_quantities_and_missing_ones_empty() -> None:
    heart = recorded("a").heart
    known = dict(zip(QUANTITIES, truths(heart), strict=True))
    assert heart.theta is not None
    assert [known[name] for name in THETA_NAMES] == heart.theta.tolist()
    assert (known["peak_active_kpa"], known[ISOMETRIC]) == (heart.peak_active_kpa, heart.isometric_kpa)
    assert known["peak_kpa"] == pytest.approx(heart.curve.stiffness_kpa.max(), rel=1e-3)
    without = dict(zip(QUANTITIES, truths(replace(heart, theta=None)), strict=True))
    assert [name for name, value in without.items() if np.isnan(value)] == ["k0_kpa", "k_atp_per_s"]
    other = truths(replace(heart, theta=None, k_sr_per_s=None))
    assert np.isnan(other[QUANTITIES.index("k_sr_per_s")])


@pytest.mark.parametrize(
    ("of_heart", "missed"),
    [
        (truth(), False),
        (truth(peak_active_kpa=31.0), True),
        (truth(k_sr_per_s=38.0), True),
        (truth(k0_kpa=600.0, k_atp_per_s=60.0, isometric_stiffness_kpa=200.0, duration_ms=900.0), False),
        (truth(["k_sr_per_s", "k0_kpa"]), False),
        (truth(["k_sr_per_s", "k0_kpa"], peak_active_kpa=51.0), True),
    ],
)
def test_a_heart_is_missed_by_shown_stiffness_and_k_sr_alone(
    of_heart: tuple[float, ...], missed: bool
) -> None:
    assert answer(truth=of_heart).missed is missed


def test_the_table_counts_verdicts_coverage_and_misses() -> None:
    good = [answer(0, "uninformative"), *(answer(number) for number in range(1, 30))]
    missed = [answer(30 + number, truth=truth(peak_active_kpa=20.0)) for number in range(10)]
    doubtful = [answer(40 + number, "doubtful", truth=truth(k_sr_per_s=10.0)) for number in range(8)]
    refused = [refusal(48 + number, HEART, 1, "too thick") for number in range(2)]
    whole = validation_table({"a": [*good, *missed, *doubtful, *refused]}, TITLES, SCORE)
    table = whole[whole["generator"] == "a: one"].set_index("quantity")
    assert list(table.index) == list(QUANTITIES)
    row = table.loc["peak_active_kpa"]
    assert (row["n"], row["n_not_contradicted"], row["tested"]) == (50, 40, TESTED)
    shares = row[["not_contradicted", "doubtful", "contradicted", "refused"]]
    assert shares.tolist() == pytest.approx([0.8, 0.16, 0.0, 0.04])
    assert row["coverage"] == pytest.approx(38 / 48)
    assert row["coverage_not_contradicted"] == pytest.approx(0.75)
    assert table["missed_not_contradicted"].tolist() == pytest.approx([0.25] * len(QUANTITIES))
    assert table.loc["k_sr_per_s", "coverage"] == pytest.approx(40 / 48)
    assert table.loc["k_sr_per_s", "coverage_not_contradicted"] == 1.0
    assert row["coverage_low"] == pytest.approx(beta.ppf(0.005, 38, 11))
    assert row["coverage_high"] == pytest.approx(beta.ppf(0.995, 39, 10))
    assert row["missed_not_contradicted_high"] == pytest.approx(beta.ppf(0.995, 11, 30))
    assert row["bias_log"] == pytest.approx(10 / 48 * np.log(2.0))
    assert row["width_log"] == pytest.approx(np.log(1.25 / 0.8))
    assert row["width_log_scale_fixed"] == 0.25


def test_hearts_of_several_generators_are_counted_together() -> None:
    off = truth(["k0_kpa", "k_atp_per_s"], k_sr_per_s=10.0)
    made = {
        "a": [answer(number) for number in range(5)],
        "c": [answer(number, truth=off) for number in range(10)],
        "d": [answer(number, "doubtful") for number in range(10)],
        "h": [answer(number) for number in range(30)],
    }
    table = validation_table(made, dict.fromkeys(made, "hearts"), SCORE).set_index(["generator", "quantity"])
    together, every = table.loc[POOLED_TOGETHER], table.loc[POOLED_ALL]
    assert (together["n"].min(), together["n"].max(), every["n"].max()) == (40, 50, 55)
    assert together.at["k_sr_per_s", "coverage_not_contradicted"] == pytest.approx(0.75)
    assert together.at["peak_active_kpa", "missed_not_contradicted"] == pytest.approx(0.25)
    assert together.at["peak_active_kpa", "n_not_contradicted"] == 40
    assert together.at["k0_kpa", "missed_not_contradicted"] == 0.0
    assert every.at["peak_active_kpa", "not_contradicted"] == pytest.approx(45 / 55)


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
    made = {"a": [answer()], "e": [answer(truth=truth(QUANTITIES[1:]))]}
    table = validation_table(made, TITLES, SCORE)
    assert table.loc[table["generator"] == "e: other", "quantity"].tolist() == ["peak_active_kpa"]
    assert table["generator"].value_counts().to_dict() == {
        "a: one": len(QUANTITIES),
        POOLED_ALL: len(QUANTITIES),
        "e: other": 1,
    }


def test_a_generator_that_is_refused_throughout_has_a_row_without_numbers() -> None:
    table = validation_table({"a": [refusal(0, HEART, 0, "too thick")]}, TITLES, SCORE)
    assert set(table["refused"]) == {1.0}
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
