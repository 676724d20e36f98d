"""The validation on the pages of the results: shown where its table is stored, and as that says."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from jinja2 import ChainableUndefined

from swesbi.artefacts import ArtefactError
from swesbi.report.csv import write_csv
from swesbi.report.page.page import templates
from swesbi.report.page.validation import stored_validation
from swesbi.report.table import Strong
from swesbi.report.tables.validation import read_validation
from swesbi.report.tables.validation_outcomes import ASKED, MOST_MISSED

NOT_TESTED = ("e: blocks", 60, 12, "not tested", float("nan"), float("nan"))
MISSED = ("d: spring", 60, 40, "tested", 0.6, 0.4)
REACHED = ("a: own", 60, 55, "tested", 0.982, 0.05)


def made_table() -> pd.DataFrame:
    """A row of attained stiffness of each of three generators."""
    return pd.DataFrame([made_row(*made) for made in (REACHED, MISSED, NOT_TESTED)])


def made_row(
    generator: str, n: int, good: int, tested: str, coverage: float, missed: float
) -> dict[str, object]:
    return {
        "generator": generator, "quantity": "attained_kpa", "n": n, "not_contradicted": good / n,
        "strained": 0.0, "contradicted": 1.0 - good / n, "coverage": 0.733, "coverage_low": 0.6,
        "coverage_high": 0.84, "coverage_not_contradicted": coverage,
        "coverage_not_contradicted_low": coverage,
        "coverage_not_contradicted_high": coverage, "missed_not_contradicted": missed, "bias_log": -0.18,
        "width_log": 0.45, "n_not_contradicted": good, "tested": tested,
    }  # fmt: skip


def stored(folder: Path) -> Path:
    write_csv(folder / "validation.csv", made_table())
    return folder / "validation.csv"


def test_generators_stand_worst_first_and_what_is_missed_is_bold(tmp_path: Path) -> None:
    rows = stored_validation(stored(tmp_path)).table.rows
    assert [row.cells[0] for row in rows] == ["(d) spring", "(e) blocks", "(a) own"]
    assert rows[0].cells[1:7] == ("attained stiffness", "60", "67", "0", "33", "73.3 (60 to 84)")
    assert rows[0].cells[7:] == (Strong("60.0 (60 to 60)"), Strong("40.0"), "−0.18", "0.45")
    assert rows[1].muted and rows[1].cells[7:9] == ("not tested", "not tested")


def test_sentences_follow_the_numbers(tmp_path: Path) -> None:
    below, missed, untested, of_a, reached = stored_validation(stored(tmp_path)).brief
    assert (ASKED[0], MOST_MISSED) == (0.85, 0.15)
    assert below.endswith(
        "fewer than 85 % of the hearts not contradicted: (d) spring, attained stiffness 60.0 %."
    )
    assert missed == "More than 15 % missed and not contradicted: (d) spring, 40.0 %."
    assert untested == "Not tested, since too few hearts are not contradicted: (e) blocks, 12 of 60."
    assert of_a.startswith(
        "(a) own: 91.7 % not contradicted, at least 80 %; of all answered hearts outside 85 to"
    )
    assert reached.endswith(
        "in at least 85 % of the hearts not contradicted: (a) own, attained stiffness 98.2 %."
    )


def test_a_table_that_lacks_a_column_is_named(tmp_path: Path) -> None:
    path = tmp_path / "validation.csv"
    made_table().drop(columns="tested").to_csv(path, index=False)
    with pytest.raises(ArtefactError, match=r"validation.csv: lacks the columns tested"):
        read_validation(path)


@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("name", ["checks", "index"])
def test_pages_show_the_validation_where_there_is_one(tmp_path: Path, name: str, there: bool) -> None:
    section = stored_validation(stored(tmp_path)) if there else None
    # all but the validation is left out of these pages
    page = templates().overlay(undefined=ChainableUndefined).get_template(f"{name}.html")
    text = page.render(page={"validation": section}, here=name, root="../")
    assert ('<a href="#validation">' in text) is there
    assert text.count('<section id="validation">') == int(there)
