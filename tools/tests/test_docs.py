"""Tables of pages are filled from stored tables and a study's results; what is wrong is reported."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy

from tools.docs.__main__ import main
from tools.docs.directives import PageError, filled
from tools.docs.made import MADE, OF_STORED
from tools.model_version import MODEL_VERSION, read_versions

HEARTS = """subject,experiment,parameter,n,coverage,median,low,high,inside,note
01,a,k0,1200,0.905,1.25,-1,2.5,True,x|y
02,a,k0,3,0.5,,,,False,
01,a,k1,4,0.25,7,6,8,True,z
02,a,k1,5,0.125,9,8,10,True,z
01,b,k0,1,1,1,1,1,True,z
"""
PATH = "docs/tables/hearts.csv"


def page(keys: str, path: str = PATH) -> str:
    return f"# Page\n\nText.\n<!-- table {path}\n{keys}\n-->\nold\n<!-- end table -->\nAfter.\n"


@pytest.fixture
def fill(tmp_path: Path) -> Callable[[str], list[str]]:
    """Fills a page and returns the lines of its table."""
    (tmp_path / "docs" / "tables").mkdir(parents=True)
    (tmp_path / PATH).write_text(HEARTS, encoding="utf-8")

    def lines(text: str) -> list[str]:
        done = filled("docs/page.md", text, lambda path: tmp_path / path)
        assert filled("docs/page.md", done, lambda path: tmp_path / path) == done
        return [line for line in done.splitlines() if line.startswith("|")]

    return lines


def test_columns_are_shown_as_asked(fill: Callable[[str], list[str]]) -> None:
    keys = """where: experiment == "a" and parameter == "k0"  # a comment
sort: [-subject]
columns:
  subject: {head: Subject}
  n: {head: Hearts}
  coverage: {head: Coverage (%), digits: 1, percent: true}
  "{median} [{low}, {high}]": {head: Median, digits: 1}
  inside: {head: Inside, words: {"False": missed}}
  note: {head: Note}
  high: {head: High, significant: 1}"""
    assert fill(page(keys)) == [
        "| Subject | Hearts | Coverage (%) | Median | Inside | Note | High |",
        "|---|---:|---:|---:|---|---|---:|",
        "| 02 | 3 | 50.0 | – | missed | – | – |",
        "| 01 | 1,200 | 90.5 | 1.2 [−1.0, 2.5] | yes | x\\|y | 2 |",
    ]


def test_one_row_is_made_of_several(fill: Callable[[str], list[str]]) -> None:
    keys = """where: experiment == "a"
wide: {row: [subject], by: parameter}
sort: ["-median k1"]
columns: {subject: {head: Subject}, median k1: {head: k_1}, "{low k0} to {low k1}": {head: Low}}"""
    assert fill(page(keys))[2:] == ["| 02 | 9 | – to 8 |", "| 01 | 7 | −1 to 6 |"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (page("columns: {n: {head: N}}", "docs/tables/no.csv"), "no.csv does not exist"),
        (page("columns: {n: {head: N}}", "results/x.csv"), "no stored table; name a CSV of docs/tables"),
        (page("columns: {m: {head: M}}"), "no column of .* is called 'm'; it has subject, experiment"),
        (page("columns: {'{m}': {head: M}}"), "is called 'm'"),
        (page("columns: {n: N}"), "columns.n: "),
        (page("where: n > > 1\ncolumns: {n: {head: N}}"), "where: "),
        (page("sort: [m]\ncolumns: {n: {head: N}}"), "is called 'm'"),
        (page("where: m > 1\ncolumns: {n: {head: N}}"), "where: .*'m'.*; .* has subject"),
        (page("where: n > 9999\ncolumns: {n: {head: N}}"), "no row of .* where n > 9999; mend the query"),
        (page("wide: {row: [subject], by: parameter}\ncolumns: {n: {head: N}}"), "the same subject, param"),
        (page("column: {n: {head: N}}"), "columns: .*; column: .*; the keys are where, wide, sort and"),
        (page("columns: {n: {head: a: b}}"), "the keys are no YAML"),
        ("\n\n\n<!-- table docs/tables/hearts.csv\ncolumns: {}\n-->\n", "has no partner"),
        ("\n\n\n<!-- end table -->\n", "has no partner"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(fill: Callable[[str], list[str]], text: str, said: str) -> None:
    with pytest.raises(PageError, match=rf"(?s)^docs/page\.md:4: .*{said}"):
        fill(text)


def test_more_rows_than_fifteen_are_refused(fill: Callable[[str], list[str]], tmp_path: Path) -> None:
    pd.DataFrame({"n": range(16)}).to_csv(tmp_path / PATH, index=False)
    with pytest.raises(PageError, match="16 rows of .*, and 15 are shown at most"):
        fill(page("columns: {n: {head: N}}"))
    assert len(fill(page("where: n > 0\ncolumns: {n: {head: N}}"))) == 17


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with pages that name a table and a figure of a study, whose results lie beside it."""
    monkeypatch.chdir(ROOT)
    for name in ("docs/figures", "results/tables", "results/figures"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "results" / "tables" / "hearts.csv").write_text(HEARTS, encoding="utf-8")
    (tmp_path / "results" / "figures" / "hearts.png").write_bytes(b"drawn")
    (tmp_path / "overlay.yaml").write_text(f"results: {tmp_path / 'results'}\n", encoding="utf-8")
    (tmp_path / "README.md").write_text("[all](docs/tables/study/tables/hearts.csv)\n", encoding="utf-8")
    text = page('where: experiment == "b"\ncolumns: {n: {head: N}}', "docs/tables/study/tables/hearts.csv")
    (tmp_path / "docs" / "page.md").write_text(f"{text}![Hearts](figures/hearts.png)\n", encoding="utf-8")
    return tmp_path


def made(project: Path, *more: str) -> int:
    return main(["--overlay", str(project / "overlay.yaml"), "--folder", str(project), *more])


def test_what_pages_name_is_copied_from_the_study_with_its_version(project: Path) -> None:
    old = project / "docs" / "tables" / "study" / "old.csv"
    old.parent.mkdir(parents=True)
    old.write_text("n\n1\n", encoding="utf-8")
    assert made(project) == 0
    tables = project / "docs" / "tables"
    assert (tables / "study" / "tables" / "hearts.csv").read_text(encoding="utf-8") == HEARTS
    assert read_versions(tables) == {"study/tables/hearts": MODEL_VERSION} and not old.exists()
    assert (project / "docs" / "figures" / "hearts.png").read_bytes() == b"drawn"
    text = (project / "docs" / "page.md").read_text(encoding="utf-8")
    assert "| 1 |" in text and "old" not in text and text.startswith("# Page\n\nText.\n<!-- table")


def test_pages_are_filled_from_stored_tables_without_a_study(project: Path) -> None:
    assert made(project) == 0
    (project / "results" / "tables" / "hearts.csv").unlink()
    stored = project / "docs" / "tables" / "study" / "tables" / "hearts.csv"
    stored.write_text(HEARTS.replace("01,b,k0,1,", "01,b,k0,8,"), encoding="utf-8")
    assert made(project, "--stored") == 0
    assert "| 8 |" in (project / "docs" / "page.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("spoilt", "said"),
    [
        ("results/tables/hearts.csv", r"README.md:1: .*finish the study first"),
        ("results/figures/hearts.png", r"docs/page.md:11: neither .* nor docs/figures/hearts.png exists"),
    ],
)
def test_nothing_is_written_when_one_thing_fails(
    project: Path, capsys: pytest.CaptureFixture[str], spoilt: str, said: str
) -> None:
    (project / spoilt).unlink()
    before = {path: path.read_bytes() for path in project.rglob("*") if path.is_file()}
    assert made(project) == 2
    assert re.search(said, capsys.readouterr().err)
    assert {path: path.read_bytes() for path in project.rglob("*") if path.is_file()} == before


@pytest.mark.slow(minutes=0.5)
def test_tables_of_the_engine_are_made_of_a_finished_study(finished: StudyCopy, tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    links = " ".join(f"[{name}](docs/tables/{name}.csv)" for name in [*MADE, *OF_STORED])
    (tmp_path / "README.md").write_text(links, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(finished.folder)
        assert main(["--overlay", "smoke.yaml", "--folder", str(tmp_path)]) == 0
    tables = {name: pd.read_csv(tmp_path / "docs" / "tables" / f"{name}.csv") for name in MADE}
    assert (tables["nuisances"]["low"] < tables["nuisances"]["median"]).all()
    assert set(tables["verdicts"]["experiment"]) >= {"paper", "calibrated"}
    assert tables["noise"]["percent"].between(0.0, 20.0).all() and tables["epochs"]["best"].any()
    assert set(read_versions(tmp_path / "docs" / "tables")) == {*MADE, *OF_STORED}


def test_what_stored_tables_give_is_made_again_without_a_study(tmp_path: Path) -> None:
    """`make full` renews the tables of calibration, and the page shows them together."""
    tables = tmp_path / "docs" / "tables"
    tables.mkdir(parents=True)
    (tmp_path / "README.md").write_text("[coverage](docs/tables/coverage.csv)", encoding="utf-8")
    assert main(["--stored", "--folder", str(tmp_path)]) == 0
    own = pd.read_csv(ROOT / "docs" / "tables" / "amortised_recovery.csv")
    assert pd.read_csv(tables / "coverage.csv").loc[0, "n"] == own["n"].max()
