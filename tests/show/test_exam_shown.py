"""The exam on the page and in the documentation: what a made-up table says is what is written."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Final

import pandas as pd
import pytest
from exam_case import CONFIG, answer
from jinja2 import ChainableUndefined
from study_copy import ROOT

from swesbi.artefacts import ArtefactError
from swesbi.config.read import read_yaml
from swesbi.config.study import load_study
from swesbi.exam.score import HeartAnswer
from swesbi.exam.settings import NoiseLevel
from swesbi.exam.table import exam_table as table_of
from swesbi.exam.table import samplers_table as samplers_of
from swesbi.show.csv import write_csv
from swesbi.show.docs.exam import (
    MARK,
    SITTING_TABLES,
    SITTINGS,
    ExamResults,
    calibration_part,
    page_part,
    sittings_part,
)
from swesbi.show.docs.marks import PART
from swesbi.show.page.exam import sat_exam
from swesbi.show.page.page import templates
from swesbi.show.table import Strong
from swesbi.show.tables.exam import (
    exam_table,
    generators_table,
    pressures_table,
    read_exam,
    samplers_table,
)
from swesbi.show.tables.exam_outcomes import in_brief

TITLES: Final = {"a": "own", "b": "wide", "d": "spring", "e": "blocks", "f": "bonds", "h": "other"}
SHIPPED: Final = read_yaml(ROOT / "config.yaml")
PAGES: Final = {
    "docs/exam.md": page_part,
    "docs/calibration.md": calibration_part,
}
MARKED: Final = [
    *((page, MARK, part) for page, part in PAGES.items()),
    ("docs/exam.md", SITTINGS, sittings_part),
]


def hearts(inside: int, outside: int, unsupported: int = 0, without_k_sr: bool = False) -> list[HeartAnswer]:
    """So many supported hearts whose intervals hold the truth or do not, and unsupported ones that do."""
    truth = (40.0, float("nan") if without_k_sr else 30.0, 60.0, 6.0)
    far = (80.0, *truth[1:])
    return [
        *(answer(number, truth=truth) for number in range(inside)),
        *(answer(number, truth=far) for number in range(outside)),
        *(answer(number, "unsupported", truth=truth) for number in range(unsupported)),
    ]


MADE: Final = {
    "a": hearts(54, 1, 5),
    "b": hearts(80, 10, 110),
    "d": hearts(24, 16, 20),
    "e": hearts(10, 2, 48),
    "f": hearts(36, 4, 0, without_k_sr=True),
}


def informed(before: HeartAnswer) -> HeartAnswer:
    """The same heart with an interval that is half as wide."""
    return replace(before, low=before.median * 0.8**0.5, high=before.median * 1.25**0.5)


INFORMED: Final = {letter: [informed(one) for one in MADE[letter]] for letter in ("a", "d")}


def made_table(noise: NoiseLevel = "cohort", **answers: list[HeartAnswer]) -> pd.DataFrame:
    return table_of(answers or MADE, TITLES, noise, CONFIG.exam.score)


def store(folder: Path, pressures: bool = False) -> Path:
    """Write the tables as `make exam` stores them, those with pressures only if asked for."""
    levels: dict[str, NoiseLevel] = {"exam": "cohort", "exam_former_noise": "former"}
    for stem, noise in levels.items():
        write_csv(folder / f"{stem}.csv", made_table(noise))
        write_csv(folder / f"{stem}_samplers.csv", samplers_of(MADE, TITLES, noise))
    if pressures:
        write_csv(folder / "exam_pressures.csv", made_table("cohort", **INFORMED))
        write_csv(folder / "exam_pressures_samplers.csv", samplers_of(INFORMED, TITLES, "cohort"))
    return folder


def test_generators_stand_worst_first_with_a_row_a_quantity() -> None:
    rows = exam_table(made_table(), "The exam").rows
    names = [str(row.cells[0]) for row in rows]
    assert list(dict.fromkeys(names)) == ["(d) spring", "(e) blocks", "(b) wide", "(f) bonds", "(a) own"]
    assert names.count("(d) spring") == 4
    assert [row.cells[1] for row in rows if row.cells[0] == "(f) bonds"] == [
        "attained stiffness",
        "k_0",
        "k_ATP",
    ]
    worst = rows[0].cells
    assert worst[1:6] == ("attained stiffness", "60", "67", "0", "33")
    assert str(worst[6]).startswith("73.3 (")
    assert isinstance(worst[7], Strong) and worst[7].text.startswith("60.0 (")
    assert worst[8:] == (Strong("40.0"), "−0.18", "0.45")


def test_who_has_fewer_than_thirty_supported_is_not_tested() -> None:
    table = made_table()
    (row, *_) = [row for row in exam_table(table, "The exam").rows if row.cells[0] == "(e) blocks"]
    assert row.muted and row.cells[7:9] == ("not tested", "not tested")
    assert row.cells[6] != "not tested", "the coverage of all answered is told"
    (short,) = [row for row in generators_table(table, "The exam").rows if row.cells[0] == "(e) blocks"]
    assert short.cells == ("(e) blocks", "60", "20", "not tested", "not tested", "not tested")


def test_a_generator_without_relaxation_rate_has_a_dash() -> None:
    (row,) = [row for row in generators_table(made_table(), "x").rows if row.cells[0] == "(f) bonds"]
    assert row.cells[2:] == ("100", "90.0 (76 to 97)", "–", "10.0")


def test_sentences_follow_the_numbers_worst_first() -> None:
    below, missed, untested, of_b, of_a, reached = in_brief(made_table())
    asked = "85 % of the supported hearts"
    assert (
        below == f"The interval holds the truth in fewer than {asked}: (d) spring, attained stiffness 60.0 %."
    )
    assert missed == "More than 15 % missed and supported: (d) spring, 40.0 %."
    assert untested == "Not tested, since too few hearts are supported: (e) blocks, 12 of 60."
    assert of_b == (
        "(b) wide: 45.0 % supported, fewer than the asked 60 %; of all answered hearts outside 85 to 95 % "
        "lie k_SR 100.0 %, k_0 100.0 %, k_ATP 100.0 %."
    )
    assert of_a == (
        "(a) own: 91.7 % supported, at least 80 %; of all answered hearts each quantity in 85 to 100 %."
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
    assert any("missed and supported" in sentence for sentence in sentences) is not reached


def test_nothing_is_said_of_what_there_is_none_of() -> None:
    assert in_brief(made_table(d=hearts(2, 2))) == (
        "Not tested, since too few hearts are supported: (d) spring, 4 of 4.",
    )


def test_how_hearts_were_answered_stands_by_generator() -> None:
    rows = samplers_table(samplers_of({"e": hearts(3, 0)}, TITLES, "former"), "The exam").rows
    assert [row.cells for row in rows] == [("(e) blocks", "3", "0", "0", "51", "0.0", "0.0")]


def test_a_table_that_lacks_a_column_is_named(tmp_path: Path) -> None:
    path = tmp_path / "exam.csv"
    made_table().drop(columns="tested").to_csv(path, index=False)
    with pytest.raises(ArtefactError, match=r"exam.csv: lacks the columns tested"):
        read_exam(path)


def test_every_page_shows_the_stored_exam(tmp_path: Path) -> None:
    results = ExamResults.read(store(tmp_path), 0.9)
    assert results is not None
    whole, calibration = page_part(results), calibration_part(results)
    for noise, figure in (("noise", "exam"), ("former noise", "exam_former_noise")):
        assert f"**At the cohort's {noise}:**" in whole and f"(figures/{figure}.png)" in whole
    assert (
        whole.count("| (d) spring | attained stiffness |") == whole.count("| Hearts | Number | Refused") == 2
    )
    assert calibration.count("| (d) spring | attained stiffness |") == 1
    assert all(text.count("- Not tested, since") == 2 for text in (whole, calibration))
    assert whole.count("| (d) spring | 60 | 67 | **60.0 (43 to 75)** | 100.0 (91 to 100) | **40.0** |") == 2
    assert "90 % intervals" in calibration
    assert whole.endswith("the exam has not been sat yet: `python -m swesbi exam --pressures`.")
    for text in (whole.rpartition("\n\n")[0], calibration):
        assert "not been sat" not in text and "nan" not in text


def test_the_page_compares_coverage_and_width_without_and_with_pressures(tmp_path: Path) -> None:
    results = ExamResults.read(store(tmp_path, pressures=True), 0.9)
    assert results is not None
    _, mark, part = page_part(results).partition("**With cuff pressures**")
    assert mark and "not been sat" not in part and "nan" not in part
    assert "attained stiffness: intervals 0.50 to 0.50 times as wide with pressures" in part
    assert "the least coverage of all answered is 73.3 %, without 73.3 %." in part
    assert "(figures/exam_pressures.png)" in part
    (row,) = [line for line in part.splitlines() if line.startswith("| (d) spring | attained stiffness |")]
    assert row.endswith("| 0.45 | 0.22 |") and row.count("73.3 (60 to 84)") == 2
    assert "(b) wide" not in part and "(a) own" in part
    assert "cuff pressures" not in calibration_part(results)


def test_pressures_without_the_exam_itself_are_refused(tmp_path: Path) -> None:
    folder = store(tmp_path, pressures=True)
    for stem in ("exam", "exam_former_noise"):
        for suffix in ("", "_samplers"):
            (folder / f"{stem}{suffix}.csv").unlink()
    with pytest.raises(ArtefactError, match=r"exam.csv: missing beside exam_pressures.csv"):
        ExamResults.read(folder, 0.9)


def test_pressures_of_other_generators_are_refused() -> None:
    with pytest.raises(ArtefactError, match="has none of the generators without; run `make exam`"):
        pressures_table(made_table(), made_table(h=hearts(1, 0)), "The exam")


def test_without_stored_tables_it_has_not_been_sat(tmp_path: Path) -> None:
    assert ExamResults.read(tmp_path, 0.9) is None
    for part in PAGES.values():
        assert part(None).startswith("**The exam has not been sat yet**")
        assert "\n" not in part(None)


def test_some_of_the_tables_are_not_the_exam(tmp_path: Path) -> None:
    (store(tmp_path) / "exam_former_noise_samplers.csv").unlink()
    with pytest.raises(ArtefactError, match=r"exam_former_noise_samplers.csv: missing beside"):
        ExamResults.read(tmp_path, 0.9)


def test_the_former_noise_may_follow_and_the_cohort_s_may_not(tmp_path: Path) -> None:
    folder = store(tmp_path)
    former = [folder / f"exam_former_noise{suffix}.csv" for suffix in ("", "_samplers")]
    kept = [path.read_text() for path in former]
    for path in former:
        path.unlink()
    results = ExamResults.read(folder, 0.9)
    assert results is not None
    for part in (page_part, calibration_part):
        assert "At the cohort's former noise the exam has not been sat yet." in part(results)
    for path, text in zip(former, kept, strict=True):
        path.write_text(text)
    for suffix in ("", "_samplers"):
        (folder / f"exam{suffix}.csv").unlink()
    with pytest.raises(ArtefactError, match=r"exam.csv: missing beside exam_former_noise.csv"):
        ExamResults.read(folder, 0.9)


@pytest.mark.parametrize(("page", "mark", "part"), MARKED)
def test_the_pages_say_what_the_stored_tables_say(
    page: str, mark: str, part: Callable[[ExamResults | None], str]
) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    (body,) = [match["body"] for match in PART.finditer(text) if match["name"] == mark]
    stored = ExamResults.read(ROOT / "docs" / "tables", load_study(SHIPPED).config.exam_interval)
    assert body.strip() == part(stored).strip(), "run `make docs` after `make exam`"


def test_both_sittings_stand_beside_each_other(tmp_path: Path) -> None:
    folder = store(tmp_path)
    first, second = (folder / f"{name}.csv" for name in SITTING_TABLES)
    write_csv(first, made_table(**(MADE | {"d": hearts(0, 0, 60)})))
    write_csv(second, made_table(**{letter: MADE[letter] for letter in "abd"}))
    results = ExamResults.read(folder, 0.9)
    assert results is not None
    assert "(e) blocks" not in sittings_part(results)
    (row,) = [
        line
        for line in sittings_part(results).splitlines()
        if line.startswith("| (d) spring | attained stiffness |")
    ]
    cells = [cell.strip() for cell in row.split("|")[3:-1]]
    assert cells[:2] == ["0", "67"]
    assert [cell.split(" ")[0] for cell in cells[2:4]] == ["100.0", "73.3"]
    assert cells[4:6] == ["not tested", "**40.0**"]


def test_the_page_shows_the_exam_that_was_sat(tmp_path: Path) -> None:
    sat = sat_exam(store(tmp_path) / "exam.csv")
    text = templates().get_template("exam.html").render(page=SimpleNamespace(exam=sat), root="../")
    assert text.index("The shipped study sat the exam") < text.index("(d) spring")
    assert "12 of 60" in text


@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("name", ["checks", "report"])
def test_pages_show_the_exam_where_there_is_one(tmp_path: Path, name: str, there: bool) -> None:
    section = sat_exam(store(tmp_path) / "exam.csv") if there else None
    # all but the exam is left out of these pages
    page = templates().overlay(undefined=ChainableUndefined).get_template(f"{name}.html")
    text = page.render(page={"exam": section}, here=name, root="../")
    assert ('<a href="#exam">' in text) is there
    assert text.count('<section id="exam">') == int(there)


def test_make_stores_what_the_documentation_reads() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    (recipe,) = re.findall(r"^exam: .*\n((?:\t.*\n)+)", makefile, re.MULTILINE)
    assert "for name in exam exam_former_noise exam_pressures;" in recipe
    assert "swesbi exam --pressures" in recipe
    assert "results/tables/$$name.csv results/tables/$${name}_samplers.csv docs/tables/" in recipe
    assert "results/figures/$$name.png docs/figures/" in recipe
