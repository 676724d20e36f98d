"""The project's own tables: what is written is read back as it was, and no text is a formula."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from swesbi.artefacts.csv import NAMES, read_csv, write_csv

LIKE_NUMBERS = ("NA", "nan", "None", "007", "1e3", "-1", "True", "", "inf", "+4 weeks")
ODD = ('a,"b"', "'", "-", "'-", "β")
FORMULAS = ("=1+1", "-1+1", "@x", "+x()", "'=1", "''@x")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "table.csv"


@pytest.mark.parametrize("column", [*NAMES, "reason"])
def test_names_are_read_as_they_were_written(path: Path, column: str) -> None:
    names = [*LIKE_NUMBERS, *ODD, *FORMULAS]
    for cells in (names, *([name] for name in names)):
        write_csv(path, pd.DataFrame({"number": 1.5, column: cells}))
        assert list(read_csv(path, ("reason",))[column]) == cells


def test_other_columns_hold_numbers_truth_values_or_texts(path: Path) -> None:
    table = pd.DataFrame(
        {"x": [-1.5, np.nan], "n": [7, -8], "is": [True, False], "word": ["NA", "b"], "none": [np.nan] * 2}
    )
    write_csv(path, table)
    pd.testing.assert_frame_equal(read_csv(path), table)


def test_no_text_of_a_table_is_a_formula(path: Path) -> None:
    written = (*FORMULAS, "-0.67 ± 0.03", "-1.5e-3", "+inf", "-0.05 (one subject)")
    write_csv(path, pd.DataFrame({"x": -1.5, "text": written}))
    cells = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    assert {number for number, _ in cells} == {"-1.5"}
    assert [text for _, text in cells[: len(FORMULAS)]] == [f"'{text}" for text in FORMULAS]
    assert tuple(text for _, text in cells[len(FORMULAS) :]) == written[len(FORMULAS) :]
