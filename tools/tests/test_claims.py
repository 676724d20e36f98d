"""What README and documentation say in numbers is found where the manifest says; one change is reported."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi.artefacts import ArtefactError
from tools.claims.findings import Finding, claims_judged
from tools.claims.manifest import Manifest, read_manifest
from tools.claims.prose import quotations, rounding, unaccounted, value_of
from tools.docs.shown import CLAIMS, stored_in
from tools.model_version import MODEL_VERSION, STORED
from tools.verify import main, verified

README = "Intervals contain the true value in 3 of four hearts, by `2` methods.\n"
TABLE = "heart,covered\na,1\nb,1\nc,0\nd,1\n"
SMALL = """
complete: [README.md]
sources: { hearts: docs/tables/hearts.csv }
claims:
  - text: contain the true value in {} of {} hearts
    found:
      - { of: hearts, value: covered, by: sum }
      - { of: hearts, value: covered, by: count }
  - text: the true value in {} of
    found:
      - { of: hearts, value: covered, where: heart != 'x', by: sum }
no_claims: []
"""
PAGE = """<!-- table docs/tables/hearts.csv
where: covered == 0
columns: {heart: {head: Heart}, covered: {head: Covered}}
-->

| Heart | Covered |
|---|---:|
| c | 0 |

<!-- end table -->
"""
UNACCOUNTED = "a number that no claim accounts for"
COMPLETE = ("compare-and-plan", "comparison", "faq", "reproduction", "validation")
VERSIONS = f"table,model_version\nhearts,{MODEL_VERSION}\nstudy/hearts,{MODEL_VERSION}\n"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a README of two numbers, a page, the table that gives both, and the manifest."""
    texts = {
        "README.md": README,
        "docs/page.md": PAGE,
        CLAIMS: SMALL,
        "docs/tables/hearts.csv": TABLE,
        "docs/tables/settings.csv": "key\nseed\n",
        "docs/tables/model_versions.csv": VERSIONS,
    }
    (tmp_path / STORED).mkdir(parents=True)
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    for name in ("config.yaml", "config", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def failures(project: Path) -> list[Finding]:
    return [each for each in verified(None, project) if not each.holds]


def shipped(manifest: Manifest) -> list[Finding]:
    return [each for each in claims_judged(manifest, stored_in(ROOT)) if not each.holds]


def rewrite(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.parametrize("path", [ROOT / CLAIMS, *sorted(ROOT.glob("studies/*/claims.yaml"))], ids=str)
def test_stored_tables_settings_and_code_give_what_is_claimed(path: Path) -> None:
    assert shipped(read_manifest(path)) == []


@pytest.mark.parametrize("name", ["README.md", *(f"docs/{name}.md" for name in COMPLETE)])
def test_a_complete_page_is_not_accounted_for_by_chance(name: str) -> None:
    """Without one claim or exception its numbers are reported."""
    manifest = read_manifest(ROOT / CLAIMS)
    assert name in manifest.complete
    for field in ("claims", "no_claims"):
        entries = getattr(manifest, field)
        if of_page := [each for each in entries if each.file == name]:
            rest = tuple(each for each in entries if each is not of_page[0])
            found = shipped(manifest.model_copy(update={field: rest}))
            assert UNACCOUNTED in {each.found for each in found}


def test_a_project_that_is_as_it_says(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert failures(project) == []
    assert main([]) == 0
    assert capsys.readouterr().out == "5 hold, 0 fail\n"


@pytest.mark.parametrize(
    ("file", "old", "new", "where", "expected", "found"),
    [
        ("README.md", "in 3 of", "in 4 of", "README.md:1", "4", "3"),
        ("README.md", "methods.", "methods in 12 s.", "README.md:1", "", UNACCOUNTED),
        ("README.md", "four hearts", "four old hearts", "README.md", "", "the text is no longer there"),
        ("docs/page.md", "| c | 0 |", "| c | 1 |", "docs/page.md:1", "| c | 1 |", "| c | 0 |"),
        ("docs/tables/model_versions.csv", f"\nhearts,{MODEL_VERSION}", "\nhearts,1",
         "docs/tables/hearts.csv", f"version {MODEL_VERSION}", "version 1"),
        ("docs/tables/model_versions.csv", f"\nhearts,{MODEL_VERSION}", "",
         "docs/tables/hearts.csv", f"version {MODEL_VERSION}", "no version"),
        ("docs/tables/hearts.csv", "d,1", "d,0", "README.md:1", "3", "2"),
        ("docs/tables/hearts.csv", "c,0", "e,0", "docs/page.md:1", "| c | 0 |", "| e | 0 |"),
    ],
    ids=["number", "new number", "words", "cell", "older version", "no version", "its value", "its table"],
)  # fmt: skip
def test_one_change_turns_verify_red(
    project: Path, capsys: pytest.CaptureFixture[str], file: str, old: str, new: str, where: str,
    expected: str, found: str,
) -> None:  # fmt: skip
    rewrite(project / file, old, new)
    assert (where, expected, found) in {(each.where, each.expected, each.found) for each in failures(project)}
    assert main([]) == 1
    printed = capsys.readouterr().out
    assert f"{where}: " in printed and f"found: {found}" in printed


def test_a_table_of_an_older_version_holds_where_each_page_with_it_says_so(project: Path) -> None:
    rewrite(project / "docs" / "tables" / "model_versions.csv", f"\nhearts,{MODEL_VERSION}", "\nhearts,1")
    page = project / "docs" / "page.md"
    page.write_text(page.read_text(encoding="utf-8") + "Of model version 1.\n", encoding="utf-8")
    assert failures(project) == []
    (project / "docs" / "other.md").write_text("[rows](tables/hearts.csv)\n", encoding="utf-8")
    assert [each.where for each in failures(project)] == ["docs/tables/hearts.csv"]


def test_a_page_that_cannot_be_filled_and_words_that_stand_twice_fail(project: Path) -> None:
    rewrite(project / "docs" / "page.md", "covered == 0", "covered == 2")
    (failed,) = failures(project)
    assert failed.where == "docs/page.md" and "docs/page.md:1: no row" in failed.found
    (project / "README.md").write_text(README + README, encoding="utf-8")
    assert "stands there 2 times: quote more" in {each.found for each in failures(project)}


def test_results_of_a_study_are_asked_rather_than_their_stored_copies(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results, copies = project / "results", project / STORED / "study"
    for folder in (results, copies):
        folder.mkdir()
        (folder / "hearts.csv").write_text(TABLE, encoding="utf-8")
    for name in ("docs/page.md", CLAIMS):
        rewrite(project / name, "tables/hearts", "tables/study/hearts")
    (project / "overlay.yaml").write_text(f"results: {results}\n", encoding="utf-8")
    asked = ["--overlay", "overlay.yaml"]
    assert main(asked) == 0
    rewrite(results / "hearts.csv", "c,0", "e,0")
    assert main(asked) == 1
    (results / "hearts.csv").unlink()
    assert main(asked) == 0
    assert "no finished study" in capsys.readouterr().out
    rewrite(copies / "hearts.csv", "c,0", "e,0")
    assert main(asked) == 1


@pytest.mark.parametrize(
    ("table", "said"),
    [(None, "does not exist"), ("heart,inside\na,1\n", "covered"), ("heart,covered\nx,1\n", "no row")],
)
def test_a_source_that_gives_no_value_fails_and_says_why(project: Path, table: str | None, said: str) -> None:
    path = project / STORED / "hearts.csv"
    path.unlink() if table is None else path.write_text(table, encoding="utf-8")
    assert [each for each in failures(project) if each.where == "README.md:1" and said in each.found]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{ of: hearts, value: covered, where", "{ of: heart, value: covered, where", "no source is called"),
        ("sources: {", "sources: { other: x.csv,", "no claim asks the source 'other'"),
        ("the true value in {} of\n", "the true value in 3 of\n", "has 0 holes and 1 values"),
        ("covered, by: count }", "covered, by: most }", r"by\b"),
    ],
)
def test_a_manifest_that_is_wrong_is_refused(project: Path, old: str, new: str, said: str) -> None:
    rewrite(project / CLAIMS, old, new)
    with pytest.raises(ArtefactError, match=said):
        read_manifest(project / CLAIMS)


def test_quotations_are_found_over_line_ends() -> None:
    (place,) = quotations("is −{} in {} of", "It is −0.84\nin  fifty of all, 1,000 times")
    assert place.numbers == ("0.84", "fifty")
    assert [value_of(text) for text in ("−0.84", "1,000", "Fifty")] == [-0.84, 1000.0, 50.0]
    assert [round(rounding(text), 6) for text in ("12", "0.84", "1,000")] == [0.5, 0.005, 0.5]


def test_code_links_names_comments_and_tables_hold_no_numbers() -> None:
    tables = "<!-- table x\nn: 9\n-->\n9\n<!-- end table --><!-- 7 -->\n"
    text = f"BSD-3-Clause `5` [six](page7.md) HDF5 k_0\n```\n8\n```\n{tables}"
    assert [(line, around[:30]) for line, around in unaccounted(text, [])] == [(1, text[:30])]


def test_levels_of_intervals_and_numbers_of_items_claim_nothing_and_shares_are_in_per_cent() -> None:
    text = "1. Of 24 hearts 71 to 89 % pass, 5, 6 and 7 % fail: 90 % intervals, or a 95 % binomial interval."
    quoted = quotations("{} to {} % pass", text)
    counts = [
        len(list(unaccounted(text, accounted, shares_only=shares)))
        for shares in (True, False)
        for accounted in ([], quoted)
    ]
    assert counts == [6, 4, 7, 5]
