"""The validation on the page: what a made-up table says is what is written."""

from __future__ import annotations

from typing import Final

import pandas as pd
import pytest
from validation_case import VALIDATION, answer, truth

from studies.validation.figure import draw_validation
from studies.validation.rounds import STORED
from studies.validation.score import HeartAnswer
from studies.validation.table import validation_table as table_of
from swesbi.report.tables.validation import (
    BY_CHANCE,
    CONFIDENCE,
    QUANTITIES,
    ROUNDS,
    in_brief,
    shown_validation,
)

TITLES: Final = {"a": "own", "c": "length", "d": "spring", "e": "blocks", "f": "bonds", "h": "other"}


def hearts(inside: int, outside: int, contradicted: int = 0) -> list[HeartAnswer]:
    """So many hearts whose intervals contain the truth or do not, and contradicted ones that do."""
    return [
        *(answer(number) for number in range(inside)),
        *(answer(number, truth=truth(peak_active_kpa=80.0)) for number in range(outside)),
        *(answer(number, "contradicted") for number in range(contradicted)),
    ]


MADE: Final = {
    "a": hearts(54, 1, 5),
    "c": hearts(40, 2),
    "d": hearts(20, 20, 20),
    "e": hearts(10, 2, 48),
    "f": hearts(7, 0, 53),
    "h": hearts(38, 2),
}


def made_table(**answers: list[HeartAnswer]) -> pd.DataFrame:
    return table_of(answers or MADE, TITLES, VALIDATION.score)


def test_sentences_follow_the_numbers() -> None:
    """Those that each table has are tested beside the page."""
    *_, strangers, untested, missed, stiffness, rate, width = in_brief(made_table(), 0.4)
    assert missed.startswith("Reached: ") and missed.endswith("Found: 19.7 %.")
    assert stiffness.startswith("Reached: ") and stiffness.endswith("Found: 83.1 % (73.6 to 90.3).")
    assert strangers == "Not reached: of bonds at most 10 % are not contradicted. Found: 11.7 %."
    assert untested.endswith("bonds, 7 of 60; blocks, 12 of 60.")
    assert rate.startswith("Reached: of blocks") and rate.endswith("Found: 100.0 % (91.5 to 100.0).")
    assert width.endswith("at most 1.35 times as wide as in the second round. Found: 1.12 times.")


@pytest.mark.parametrize(
    ("inside", "outside", "contradicted", "reached"),
    [
        (47, 13, 0, [True, True, True]),  # 78.3 % reach 90.1 %, 76.7 % only 88.9 %
        (46, 14, 0, [False, True, True]),
        (27, 12, 21, [True, True, True]),  # 65 % of 60, of which 30.8 % missed
        (27, 11, 22, [True, False, True]),
        (40, 20, 0, [False, True, False]),
    ],
)
def test_of_hearts_that_fill_otherwise_three_things_are_asked(
    inside: int, outside: int, contradicted: int, reached: list[bool]
) -> None:
    outside_of = [answer(number, truth=truth(k_sr_per_s=90.0)) for number in range(outside)]
    said = in_brief(made_table(e=[*hearts(inside, 0, contradicted), *outside_of]))
    asked = ("whatever the verdict", "are not contradicted", "where not contradicted")
    for words, expected in zip(asked, reached, strict=True):
        own = next(each for each in said if words in each)
        assert own.startswith("Reached") is expected


@pytest.mark.parametrize(("inside", "outside", "reached"), [(45, 12, True), (44, 13, False)])
def test_an_interval_that_reaches_ninety_percent_is_enough(inside: int, outside: int, reached: bool) -> None:
    """Of 57 hearts 12 outside give an upper limit of 90.8 %, 13 one of 89.6 %."""
    each, _ = sorted(
        in_brief(made_table(d=hearts(inside, outside))), key=lambda sentence: "chance" in sentence
    )
    assert each.startswith("Reached") is reached


def test_rates_are_read_with_intervals_of_one_level() -> None:
    assert VALIDATION.score.confidence == CONFIDENCE
    assert BY_CHANCE == 0.19


def test_the_figure_has_a_panel_a_quantity_and_a_row_a_generator_and_those_together() -> None:
    figure = draw_validation(made_table(), 0.9)
    assert len(figure.axes) == len(QUANTITIES)
    rows = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert rows[-2:] == ["pooled: c, d, h", "pooled: all"] and len(rows) == len(TITLES) + 2


def test_the_page_shows_the_last_whole_round() -> None:
    shown = shown_validation(ROUNDS.read(STORED))
    assert any("another passive stiffness" in sentence for sentence in shown.brief)
    assert "round" in shown.table.caption
