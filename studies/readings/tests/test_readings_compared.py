"""Readings of the paper's text beside its numbers: values, distances, what is given, figure and page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from studies.readings.comparison import (
    INTERVALS,
    PAPER,
    PRINTED,
    TOGETHER,
    closest,
    deviations,
    given,
    given_table,
    printed_numbers,
    reading_values,
    readings_table,
    recovery_table,
    seeds_by_reading,
    weights_table,
)
from studies.readings.settings import CASES, ComparisonSettings, Reading, Treatment
from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES
from swesbi.report.paper.values import read_paper

COMPARISON = ComparisonSettings(spread_fraction=0.05, missing_spreads=20.0, coverage_margin=0.05)
NUMBERS = read_paper()
READINGS = {
    "base": Reading(label="as configured"),
    "quiet": Reading(label="quiet", treatment=Treatment(noise_factor=0.25)),
    "quieter": Reading(label="quieter", treatment=Treatment(noise_factor=0.5)),
    "mixed": Reading(label="mixed", treatment=Treatment(noise_factor=0.1, aligned=True)),
    "partial": Reading(label="partial", treatment=Treatment(epoch="last")),
}


def numbers(
    rmse: float = 1.14,
    coverage: Sequence[float] = (0.99, 0.98, 0.99, 0.89),
    k_sr: float = 0.265,
    supported: Sequence[str] = CASES,
) -> pd.DataFrame:
    """Numbers of a reading: those that the paper prints, unless told otherwise."""
    rows: list[tuple[str, str, int, float]] = []
    for subject in (*CASES, "E", "F"):
        rows += [("supported", subject, 93, float(subject in supported)), ("max_abs_z", subject, 93, 2.0)]
        rows.append(("rmse_prior_kpa", subject, 93, 12.61 if subject in CASES else 40.0))
    for subject, covered in zip(CASES, coverage, strict=True):
        if subject not in supported:
            continue
        values = {
            "rmse_kpa": rmse,
            "rmse_reduction_percent": 89.7,
            "r2": 0.996,
            "coverage_curve": 0.1,
            "coverage_observed": covered,
            "features_inside": 5.0,
            "all_features_inside": 1.0,
        }
        rows += [(name, subject, 93, value) for name, value in values.items()]
        for pair, value in (("0 1", -0.84), ("0 2", 0.09), ("1 2", -0.03)):
            first, second = (THETA_NAMES[int(index)] for index in pair.split())
            rows.append(("r", f"{subject} {first} {second}", 93, value))
    for epoch in (1, 93):
        of_epoch = (0.925, 0.905, k_sr if epoch == 93 else 0.9)
        rows += [
            ("recovery_coverage", name, epoch, value)
            for name, value in zip(THETA_NAMES, of_epoch, strict=True)
        ]
    frame = pd.DataFrame(rows, columns=["quantity", "of", "epoch", "value"])
    return frame.assign(chosen=(frame["epoch"] == 93).astype(int))


def made() -> dict[str, pd.DataFrame]:
    return {
        "base": numbers(rmse=1.9, coverage=(0.8, 0.8, 0.7, 0.75), k_sr=0.85),
        "quiet": numbers(),
        "quieter": numbers(rmse=1.3, coverage=(0.96, 0.95, 0.96, 0.96)),
        "mixed": numbers(k_sr=0.85),
        "partial": numbers(supported=("A", "B", "C")),
    }


@pytest.fixture
def table() -> pd.DataFrame:
    return readings_table(made(), READINGS, NUMBERS, COMPARISON)


def test_every_number_compared_is_one_that_the_paper_prints() -> None:
    printed = printed_numbers(NUMBERS, COMPARISON)
    assert list(printed) == list(PRINTED)
    assert len(printed) == 16
    assert (printed["rmse_kpa"].value, printed["rmse_kpa"].spread) == (1.14, 0.38)
    assert printed["recovery_k_sr_percent"].spread == pytest.approx(0.05 * 26.5)
    assert printed["coverage_A"].value == 0.99
    with pytest.raises(ArtefactError, match="subjects that pass"):
        printed_numbers(NUMBERS[:1], COMPARISON)


def test_means_are_of_the_supported_and_recovery_is_of_the_chosen_epoch() -> None:
    values = reading_values(made()["base"])
    assert values["supported"] == 4.0
    assert values["rmse_prior_kpa"] == pytest.approx(12.61)  # that of E and F is 40
    assert values["recovery_k_sr_percent"] == pytest.approx(85.0)
    assert values["features_inside"] == 4.0
    assert values["features_inside_of_all"] == 20.0
    assert np.isnan(reading_values(made()["partial"])["coverage_observed_D"])


def test_the_paper_s_numbers_stand_on_top_and_are_no_distance_from_themselves(table: pd.DataFrame) -> None:
    top = table.iloc[0]
    assert top["reading"] == PAPER
    printed = printed_numbers(NUMBERS, COMPARISON)
    for interval in INTERVALS:
        np.testing.assert_allclose(
            list(deviations(top, printed, interval, COMPARISON).values()), 0.0, atol=1e-12
        )
        assert given(top, printed, interval, COMPARISON) == frozenset(printed)
    assert list(table["reading"])[1:] == list(READINGS)
    assert (table["tried"] == len(READINGS)).all()


def test_the_distance_is_the_root_mean_square_in_spreads(table: pd.DataFrame) -> None:
    rows = table.set_index("reading")
    assert rows.loc["quiet", "distance_observed"] == pytest.approx(0.0, abs=1e-9)
    off = [(0.1 - value) / (0.05 * value) for value in (0.99, 0.98, 0.99, 0.89)]
    assert rows.loc["quiet", "distance_curve"] == pytest.approx(np.sqrt(np.sum(np.square(off)) / 16))
    # one subject fewer is off by a fifth of four; the coverage that it lacks by twenty spreads
    assert rows.loc["partial", "distance_observed"] == pytest.approx(
        np.sqrt((5.0**2 + 20.0**2 + 5.0**2) / 16)
    )


def test_the_closest_gives_every_number_of_every_case(table: pd.DataFrame) -> None:
    best, interval = closest(table)
    assert (best["reading"], interval) == ("quiet", "observed")
    alone = table[table["reading"].isin([PAPER, "partial"])]
    assert closest(alone)[0]["reading"] == "partial"
    with_worse = table[table["reading"].isin([PAPER, "partial", "base"])]
    assert closest(with_worse)[0]["reading"] == "base"


def test_a_coverage_is_given_within_its_margin_and_lowest_in_d(table: pd.DataFrame) -> None:
    printed = printed_numbers(NUMBERS, COMPARISON)
    rows = {str(row["reading"]): row for row in table.to_dict("records")}
    assert "coverage_D" in given(rows["quiet"], printed, "observed", COMPARISON)
    assert "coverage_D" not in given(rows["quiet"], printed, "curve", COMPARISON)
    of_quieter = given(rows["quieter"], printed, "observed", COMPARISON)
    assert {"coverage_A", "coverage_B", "coverage_C"} <= of_quieter
    assert "coverage_D" not in of_quieter
    assert "rmse_kpa" in of_quieter
    assert "rmse_kpa" not in given(rows["base"], printed, "observed", COMPARISON)


def test_ranges_are_of_settings_changed_alone(table: pd.DataFrame) -> None:
    lines = given_table(table, READINGS, NUMBERS, COMPARISON).set_index(["number", "interval"])
    error = lines.loc[("RMSE of the posterior predictive median, mean ± sd (kPa)", "")]
    assert error["given_by"] == 4
    assert error["settings"] == "noise_factor 0.25 to 0.5"  # that of `mixed` comes with another change
    k_sr = lines.loc[("coverage of k_SR (%)", "")]
    assert k_sr["readings"] == "quiet; quieter; partial"
    band = lines.loc[("coverage of the 90 % predictive interval, case A", "curve")]
    assert (band["given_by"], band["nearest_value"]) == (0, 0.1)


def test_recovery_has_a_row_for_each_checkpoint_in_percent() -> None:
    recovery = recovery_table(made(), READINGS)
    assert len(recovery) == 2 * len(READINGS)
    base = recovery[recovery["reading"] == "base"].set_index("epoch")
    assert list(base["chosen"]) == [0, 1]
    np.testing.assert_allclose(base["k_sr_per_s"], [90.0, 85.0])


def test_verdicts_are_counted_and_what_is_outside_is_named() -> None:
    seeds = pd.DataFrame(
        [
            {
                "subject": subject,
                "acquisition_seed": seed,
                "supported": int(seed > 3 + (subject == "B")),
                "within_z": int(seed > 3),
                "max_abs_z": 2.0 + seed,
                "worst_component": "post_peak_auc_kpa",
                "rmse_kpa": 1.0,
            }
            for subject in "AB"
            for seed in range(6)
        ]
    )
    verdicts = seeds_by_reading({"base": seeds, "quiet": seeds}, READINGS)
    row = verdicts.iloc[0]
    assert (row["recordings"], row["supported"], row["median_max_abs_z"]) == (6, 2, 4.5)
    assert row["most_often_outside"] == "post_peak_auc_kpa"
    together = verdicts.iloc[2]
    assert (together["subject"], together["recordings"], together["supported"]) == (TOGETHER, 6, 1)


def test_the_order_against_cmaes_is_counted() -> None:
    fits = pd.DataFrame(
        [
            {
                "subject": case,
                "mae_weight": mae,
                "correlation_weight": 1.0,
                "peak_weight": 0.0,
                "rmse_kpa": error,
            }
            for mae, error in ((1.0, 1.0), (0.0, 5.0))
            for case in CASES
        ]
    )
    by_weight = weights_table({"base": fits}, made(), READINGS).set_index("mae_weight")
    assert by_weight.loc[1.0, "below"] == 0
    assert by_weight.loc[0.0, "below"] == by_weight.loc[0.0, "supported"] == 4
