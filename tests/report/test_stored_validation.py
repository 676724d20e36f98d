from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from jinja2 import ChainableUndefined

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import write_csv
from swesbi.report.page.study import templates
from swesbi.report.table import Strong
from swesbi.report.tables.validation import POOLED_TOGETHER, ROUNDS, shown_validation

NAN = float("nan")
Rate = tuple[float, float, float]
MADE = (
    ("a: own", 60, 55, "tested", (0.982, 0.8, 1.0), (0.05, 0.0, 0.2)),
    ("d: spring", 60, 40, "tested", (0.6, 0.4, 0.78), (0.4, 0.22, 0.6)),
    ("e: blocks", 60, 12, "not tested", (NAN, NAN, NAN), (NAN, NAN, NAN)),
    (POOLED_TOGETHER, 180, 140, "tested", (0.84, 0.75, 0.91), (0.24, 0.15, 0.34)),
)


def made_table() -> pd.DataFrame:
    """A row of k_SR of each of three generators, and of several together."""
    return pd.DataFrame([made_row(*made) for made in MADE])


def made_row(
    generator: str, n: int, good: int, tested: str, coverage: Rate, missed: Rate
) -> dict[str, object]:
    row: dict[str, object] = {
        "generator": generator, "quantity": "k_sr_per_s", "n": n, "not_contradicted": good / n,
        "doubtful": 0.0, "contradicted": 1.0 - good / n, "bias_log": -0.18, "width_log": 0.45,
        "n_not_contradicted": good, "tested": tested,
    }  # fmt: skip
    rates = {
        "coverage": (0.733, 0.6, 0.84),
        "coverage_not_contradicted": coverage,
        "missed_not_contradicted": missed,
    }
    for name, limits in rates.items():
        row |= dict(zip((name, f"{name}_low", f"{name}_high"), limits, strict=True))
    return row


def stored(folder: Path) -> Path:
    """Rounds of three generators, of which the second is whole; a third asked one alone."""
    of_third = made_table().iloc[:1].assign(round=3, date="2026-12-03", model="other")
    first = made_table().assign(round=1, date="2026-12-01", model="former")
    second = made_table().assign(round=2, date="2026-12-02", model="as shipped")
    write_csv(folder / "rounds.csv", pd.concat([of_third, second, first]))
    return folder / "rounds.csv"


def test_generators_stand_worst_first_and_what_is_missed_is_bold(tmp_path: Path) -> None:
    shown = shown_validation(ROUNDS.read(stored(tmp_path))).table
    assert "round 2, 2026-12-02; as shipped" in shown.caption
    together, *rows = shown.rows
    assert together.cells[:2] == ("(c); spring; (h) together", "k_SR")
    assert together.cells[7:9] == (Strong("84.0 (75 to 91)"), Strong("24.0 (15 to 34)"))
    assert [row.cells[0] for row in rows] == ["spring", "blocks", "own"]
    assert rows[0].cells[1:7] == ("k_SR", "60", "67", "0", "33", "73.3 (60 to 84)")
    assert rows[0].cells[7:] == (Strong("60.0 (40 to 78)"), Strong("40.0 (22 to 60)"), "−0.18", "0.45")
    assert rows[1].mark == "muted" and rows[1].cells[7:9] == ("not tested", "not tested")
    assert rows[2].cells[7:9] == ("98.2 (80 to 100)", "5.0 (0 to 20)")


def test_sentences_follow_the_numbers(tmp_path: Path) -> None:
    *missing, untested = shown_validation(ROUNDS.read(stored(tmp_path))).brief
    each, chance, covered, missed, *of_blocks = missing
    assert all(sentence.startswith("Not reached: ") for sentence in missing)
    assert [sentence.rpartition(". ")[2] for sentence in of_blocks] == [
        "Found: 73.3 % (60.0 to 84.0).", "Found: 20.0 %.", "Found: –.",
    ]  # fmt: skip
    assert each.endswith("Short of it: spring, k_SR 60.0 % (40.0 to 78.0).")
    assert chance.endswith("Above it: spring, 40.0 % (22.0 to 60.0).")
    assert covered.endswith("Found: k_SR 84.0 %, 73.3 % of all answered.")
    assert missed.endswith("Found: 24.0 %.")
    assert untested.endswith("blocks, 12 of 60.")


def test_a_later_round_is_compared_with_the_second(tmp_path: Path) -> None:
    path = stored(tmp_path)
    table = pd.read_csv(path)
    third = table[table["round"] == 2].assign(round=4, width_log=0.6)
    write_csv(path, pd.concat([table, third]))
    width = shown_validation(ROUNDS.read(path)).brief[-1]
    assert width.startswith("Reached: k_SR of the own is at most 1.35 times as wide")
    assert width.endswith("Found: 1.33 times.")


def test_rounds_of_which_none_is_whole_are_named(tmp_path: Path) -> None:
    parts = [made_table().iloc[number : number + 1].assign(round=number) for number in (0, 1)]
    path = tmp_path / "rounds.csv"
    write_csv(path, pd.concat(parts).assign(date="2026-12-01", model="as shipped"))
    with pytest.raises(ArtefactError, match="no round of the validation asked all generators, a, d"):
        shown_validation(ROUNDS.read(path))


@pytest.mark.parametrize("name", ["checks", "index"])
def test_pages_show_the_validation_where_there_is_one(tmp_path: Path, name: str) -> None:
    # all but the validation is left out of these pages
    page = templates().overlay(undefined=ChainableUndefined).get_template(f"{name}.html")
    for section in (shown_validation(ROUNDS.read(stored(tmp_path))), None):
        text = page.render(page={"validation": section}, here=name, root="../")
        assert text.count('<section id="validation">') == int(section is not None)
        assert ('<a href="#validation">' in text) == (section is not None)
