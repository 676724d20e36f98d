"""The validation on the page: what a made-up table says is what is written."""

from __future__ import annotations

from typing import Final

import pandas as pd
import pytest
from validation_case import VALIDATION, answer

from studies.validation.score import HeartAnswer
from studies.validation.settings import CONFIGURED
from studies.validation.table import validation_table as table_of
from swesbi.report.page.validation import stored_validation
from swesbi.report.tables.validation_outcomes import in_brief

TITLES: Final = {"a": "own", "b": "wide", "d": "spring", "e": "blocks", "f": "bonds", "h": "other"}


def hearts(inside: int, outside: int, contradicted: int = 0, without_k_sr: bool = False) -> list[HeartAnswer]:
    """So many hearts whose intervals hold the truth or do not, and contradicted ones that do."""
    truth = (40.0, float("nan") if without_k_sr else 30.0, 60.0, 6.0)
    far = (80.0, *truth[1:])
    return [
        *(answer(number, truth=truth) for number in range(inside)),
        *(answer(number, truth=far) for number in range(outside)),
        *(answer(number, "contradicted", truth=truth) for number in range(contradicted)),
    ]


MADE: Final = {
    "a": hearts(54, 1, 5),
    "b": hearts(80, 10, 110),
    "d": hearts(24, 16, 20),
    "e": hearts(10, 2, 48),
    "f": hearts(36, 4, 0, without_k_sr=True),
}


def made_table(**answers: list[HeartAnswer]) -> pd.DataFrame:
    return table_of(answers or MADE, TITLES, VALIDATION.score)


def test_sentences_follow_the_numbers_worst_first() -> None:
    below, missed, untested, of_b, of_a, reached = in_brief(made_table())
    asked = "85 % of the hearts not contradicted"
    assert (
        below == f"The interval holds the truth in fewer than {asked}: (d) spring, attained stiffness 60.0 %."
    )
    assert missed == "More than 15 % missed and not contradicted: (d) spring, 40.0 %."
    assert untested == "Not tested, since too few hearts are not contradicted: (e) blocks, 12 of 60."
    assert of_b == (
        "(b) wide: 45.0 % not contradicted, fewer than the asked 60 %; of all answered hearts outside 85 to "
        "95 % lie k_SR 100.0 %, k_0 100.0 %, k_ATP 100.0 %."
    )
    assert of_a == (
        "(a) own: 91.7 % not contradicted, at least 80 %; of all answered hearts each quantity in 85 to "
        "100 %."
    )
    assert reached.startswith(
        f"The intervals hold attained stiffness and k_SR in at least {asked}: (b) wide,"
    )
    assert (
        "(f) bonds, attained stiffness 90.0 %; (a) own, attained stiffness 98.2 %, k_SR 100.0 %." in reached
    )


@pytest.mark.parametrize(("inside", "outside", "reached"), [(34, 6, True), (33, 7, False)])
def test_the_limit_itself_is_reached(inside: int, outside: int, reached: bool) -> None:
    sentences = in_brief(made_table(d=hearts(inside, outside)))
    assert any("in at least 85 %" in sentence for sentence in sentences) is reached
    assert any("missed and not contradicted" in sentence for sentence in sentences) is not reached


@pytest.mark.parametrize("sitting", ["sitting_1", "sitting_2"])
def test_the_page_can_show_both_stored_sittings(sitting: str) -> None:
    shown = stored_validation(CONFIGURED.with_name("tables") / f"{sitting}.csv")
    assert any("(h) another passive stiffness" in sentence for sentence in shown.brief)
