"""The table of hearts that fill as others do."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from validation_case import answer, truth

from studies.validation.filling import VARIED, filling_table


def test_a_miss_is_counted_in_the_third_that_it_lies_in() -> None:
    """k_SR is missed where the atrium contracts most, in hearts whose other values are in another order."""
    numbers = range(30)
    rng = np.random.default_rng(1)
    own = np.column_stack([np.arange(30.0), *(rng.permutation(30) for _ in VARIED[1:])])
    hearts: dict[int, Any] = {
        number: SimpleNamespace(
            own_names=VARIED, own=own[number], theta=np.array([60.0, 6.0, rng.uniform(10.0, 50.0)])
        )
        for number in numbers
    }
    missed = truth(k_sr_per_s=300.0)
    answers = [answer(number, truth=missed) if number >= 20 else answer(number) for number in numbers]
    table = filling_table(hearts, answers).set_index(["of", "third"])
    assert table.loc[("all", ""), "k_sr_covered"] == 20 / 30
    assert list(table.loc[VARIED[0], "k_sr_covered"]) == [1.0, 1.0, 0.0]
    assert list(table.loc[VARIED[0], "from"]) == [0.0, 10.0, 20.0]
    assert list(table.loc[VARIED[0], "to"]) == [9.0, 19.0, 29.0]
    assert set(table["shown_covered"]) == {1.0}
    for name in VARIED[1:]:
        assert table.loc[name, "hearts"].sum() == 30
        assert np.isclose(table.loc[name, "k_sr_covered"].mean(), 20 / 30)
