"""What rows of the benchmark of pairs come to: coverage, false change, power, flags."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import speed_case

from studies.validation.pair_rates import flags, one_row_a_pair, promised_power, rates
from swesbi.persons.change.ratios import QUANTITIES, smallest_detectable

RULE = speed_case.shipped().changes.rule


def row(number: int, **changes: object) -> dict[str, object]:
    """A row of an unchanged k_0 whose interval of the log ratio is -0.1 to 0.1."""
    return {
        "shares": "configured", "variant": "changed", "number": number, "quantity": QUANTITIES[0],
        "failure": "", "not_contradicted": "", "true_log_ratio": 0.0, "left_alone": 1, "low_log": -0.1,
        "median_log": 0.0, "high_log": 0.1, "sd_log": 0.06, "risen_1": 0.0, "fallen_1": 0.0,
        "narrowing_1": 0.3, "efficiency_1": 0.2, "sampler": "importance", "converged": 1, "p_value_1": 0.5,
        "found_distance_sd": 1.0, "true_distance_sd": 1.0, "cost_own_s": 2.0, "cost_joint_s": 3.0,
    } | changes  # fmt: skip


def rated(*rows: dict[str, object]) -> pd.Series:
    return rates(pd.DataFrame(rows), RULE).iloc[0]


def test_coverage_counts_truths_between_the_limits() -> None:
    inside, outside = row(0, true_log_ratio=0.09), row(1, true_log_ratio=0.11)
    found = rated(inside, inside | {"number": 2}, outside)
    assert (found["pairs"], found["coverage_90_n"]) == (3, 3)
    assert found["coverage_90_1"] == pytest.approx(2 / 3)
    assert found["coverage_90_low_1"] < 2 / 3 < found["coverage_90_high_1"]
    assert found["seconds_a_pair"] == 5.0


def test_pairs_not_contradicted_are_told_only_where_recordings_were_judged() -> None:
    assert rated(row(0), row(1))["pairs_not_contradicted"] is None
    found = rated(row(0, not_contradicted="yes"), row(1, not_contradicted="no", true_log_ratio=0.5))
    assert found["pairs_not_contradicted"] == 1
    assert (found["coverage_90_1"], found["coverage_90_not_contradicted_1"]) == (0.5, 1.0)


def test_false_change_is_asked_of_what_was_left_alone_and_lies_within_the_threshold() -> None:
    called = {"risen_1": 0.97}
    found = rated(
        row(0), row(1, **called),
        row(2, left_alone=0, true_log_ratio=0.05, **called),  # changed, if by little
        row(3, true_log_ratio=0.2, **called),  # loading moved it by more than counts
    )  # fmt: skip
    assert (found["false_change_n"], found["false_change_1"]) == (2, 0.5)


def test_a_call_in_the_wrong_direction_is_no_power() -> None:
    fell = {"left_alone": 0, "true_log_ratio": -0.3}
    found = rated(row(0, fallen_1=0.99, **fell), row(1, risen_1=0.99, **fell), row(2, fallen_1=0.94, **fell))
    assert (found["power_n"], found["power_1"]) == (3, pytest.approx(1 / 3))


def test_the_smallest_detectable_change_is_promised_the_power_of_the_rule() -> None:
    sd = np.array([0.02, 0.1, 0.3])
    log_ratio = np.log1p(smallest_detectable(sd, RULE))
    assert promised_power(-log_ratio, sd, RULE) == pytest.approx(RULE.power)


def test_pairs_without_an_answer_are_counted_and_no_more() -> None:
    blank = {"shares": "configured", "variant": "changed", "number": 9, "failure": "no beat", "quantity": ""}
    found = rates(pd.DataFrame([row(0), blank]), RULE)
    assert len(found) == 1
    assert (found["pairs"].item(), found["failed_pairs"].item()) == (1, 1)
    assert len(one_row_a_pair(pd.DataFrame([row(0), blank]))) == 1


def test_strangers_are_flagged_by_their_distance_found_and_true() -> None:
    far = {"variant": "strangers", "found_distance_sd": 3.5, "true_distance_sd": 2.5}
    pairs = pd.DataFrame([row(0, p_value_1=0.01, **far), row(1, **far), row(2, p_value_1=0.05)])
    table = flags(pairs, 0.05).set_index(["variant", "distance", "from_sd", "to_sd"])
    assert table.loc[("strangers", "found", 3.0, np.inf), "flagged_1"] == 0.5
    assert table.loc[("strangers", "true", 3.0, np.inf), "flagged_n"] == 0
    assert table.loc[("strangers", "true", 2.0, 3.0), "flagged_n"] == 2
    assert table.loc[("changed", "any", 0.0, np.inf), "flagged_1"] == 1.0
    assert ("changed", "found", 3.0, np.inf) not in table.index
