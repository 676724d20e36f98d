"""Rounds are added to the stored tables, each once."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from validation_case import VALIDATION, answer

from studies.validation.rounds import STORED, main
from studies.validation.table import samplers_table, validation_table
from swesbi.artefacts.csv import write_csv
from swesbi.report.tables.validation import COLUMNS, OF_ROUND, ROUNDS, letters

LETTERS = "abcdefgh"
TITLES = dict.fromkeys(LETTERS, "hearts")


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    """Copies of the stored tables."""
    path = tmp_path / "rounds.csv"
    for name in (STORED, STORED.with_name("rounds_samplers.csv")):
        (tmp_path / name.name).write_bytes(name.read_bytes())
    return path


def sit(folder: Path, stored: Path, number: int) -> None:
    """Add a round in which every interval contains the truth."""
    made = {letter: [answer(number) for number in range(40)] for letter in LETTERS}
    write_csv(folder / "validation.csv", validation_table(made, TITLES, VALIDATION.score))
    write_csv(folder / "validation_samplers.csv", samplers_table(made, TITLES))
    given = ["--round", str(number), "--date", "2030-01-02", "--model", "made up", "--stored", str(stored)]
    main([str(folder / "validation.csv"), *given])


def test_a_round_is_added_once_and_leaves_the_others_alone(
    tmp_path: Path, stored: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_text() for path in (stored, stored.with_name("rounds_samplers.csv"))}
    sit(tmp_path, stored, 9)
    assert "Reached: over hearts; hearts; hearts together at most 23 % are missed" in capsys.readouterr().out
    for path, text in before.items():
        assert path.read_text().startswith(text)
    rounds = ROUNDS.read(stored)
    added = rounds[rounds["round"] == 9]
    assert set(added[list(OF_ROUND)].itertuples(index=False, name=None)) == {(9, "2030-01-02", "made up")}
    assert letters(added) == {*LETTERS}
    assert list(pd.read_csv(stored).columns[: len(OF_ROUND)]) == [*OF_ROUND]
    with pytest.raises(ValueError, match="holds a round 9 already"):
        sit(tmp_path, stored, 9)


def test_a_table_has_the_columns_that_are_stored_and_read() -> None:
    own = validation_table({"a": [answer()]}, TITLES, VALIDATION.score)
    assert list(pd.read_csv(STORED).columns) == [*OF_ROUND, *own.columns]
    assert {*COLUMNS} <= {*own.columns}


def test_the_first_round_is_whole_and_the_second_is_not() -> None:
    _, (first, second, *_) = zip(*ROUNDS.read(STORED).groupby("round"), strict=True)
    assert letters(first) == {*VALIDATION.generators}
    assert letters(second) == {*VALIDATION.generators} - {"e", "f"}
