"""What README and documentation claim in numbers is found where the manifest says; what is wrong is told."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi.artefacts import ArtefactError
from tools.claims.findings import COLUMNS, FAILS, HOLDS, NOT_ASKED, Finding, judged, table_of
from tools.claims.manifest import Manifest, read_manifest
from tools.claims.prose import quotations, rounding, unaccounted, value_of
from tools.claims.sources import Sources

MANIFEST = ROOT / "docs" / "claims.yaml"
README = "Intervals contain the true value in 3 of four hearts, by `2` methods.\n"
SMALL = """
complete: [README.md]
sources:
  hearts: { kind: table, path: hearts.csv, made_by: make hearts }
  study: { kind: table, path: results/hearts.csv, made_by: make study, holds: any }
claims:
  - file: README.md
    text: contain the true value in {} of {} hearts
    found:
      - { of: hearts, value: covered, by: sum }
      - { of: hearts, value: covered, by: count }
  - file: README.md
    text: the true value in {} of
    found:
      - { of: study, value: covered, where: heart != 'x', by: sum }
no_claims: []
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a README of two numbers, a table that gives them, and the manifest that says so."""
    (tmp_path / "README.md").write_text(README, encoding="utf-8")
    (tmp_path / "hearts.csv").write_text("heart,covered\na,1\nb,1\nc,0\nd,1\n", encoding="utf-8")
    (tmp_path / "results").mkdir()
    shutil.copyfile(tmp_path / "hearts.csv", tmp_path / "results" / "hearts.csv")
    (tmp_path / "claims.yaml").write_text(SMALL, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def findings_of(manifest: Manifest, study: str = "full", results: str = "results") -> list[Finding]:
    return list(judged(manifest, Sources(manifest.sources, Path(results), study)))


def outcomes(project: Path, study: str = "full") -> list[str]:
    return [each.outcome for each in findings_of(read_manifest(project / "claims.yaml"), study)]


def failures(project: Path) -> list[Finding]:
    return [each for each in findings_of(read_manifest(project / "claims.yaml")) if each.outcome == FAILS]


def rewrite(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_every_number_of_the_readme_is_accounted_for_and_stored_tables_give_what_is_claimed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(ROOT)
    manifest = read_manifest(MANIFEST)
    assert "README.md" in manifest.complete
    found = findings_of(manifest, "none")
    assert [each for each in found if each.outcome == FAILS] == []
    assert sum(each.outcome == HOLDS for each in found) >= 50


def test_the_readme_is_not_accounted_for_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without one claim, its numbers are told, wherever the README has it."""
    monkeypatch.chdir(ROOT)
    manifest = read_manifest(MANIFEST)
    of_readme = [claim for claim in manifest.claims if claim.file == "README.md"]
    claim = next(each for each in of_readme if "one overview" in each.text)
    rest = manifest.model_copy(
        update={"claims": tuple(each for each in manifest.claims if each is not claim)}
    )
    told = [each for each in findings_of(rest, "none") if each.found == "a number that no claim accounts for"]
    assert len(told) == 1 and "one overview" in told[0].claim


def test_a_project_whose_claims_hold(project: Path) -> None:
    assert outcomes(project) == [HOLDS, HOLDS, HOLDS]


def test_a_changed_value_of_the_results_fails(project: Path) -> None:
    rewrite(project / "results" / "hearts.csv", "d,1", "d,0")
    (failed,) = failures(project)
    assert (failed.expected, failed.found, failed.where) == ("3", "2", "README.md:1")
    assert failed.made_by == "make study" and "sum of covered where heart != 'x'" in failed.source


def test_a_changed_number_of_the_text_fails_wherever_it_is_claimed(project: Path) -> None:
    rewrite(project / "README.md", "in 3 of", "in 4 of")
    assert [each.expected for each in failures(project)] == ["4", "4"]


def test_words_that_are_no_longer_there_fail(project: Path) -> None:
    rewrite(project / "README.md", "of four hearts", "of four old hearts")
    failed = failures(project)
    assert [each.found for each in failed][:1] == ["the text is no longer there"]
    assert any("four" in each.claim and "no claim accounts" in each.found for each in failed)


def test_words_that_stand_twice_fail(project: Path) -> None:
    (project / "README.md").write_text(README + README, encoding="utf-8")
    assert "stands there 2 times: quote more" in {each.found for each in failures(project)}


def test_a_new_number_of_the_readme_fails(project: Path) -> None:
    rewrite(project / "README.md", "methods.", "methods, in 12 minutes.")
    (failed,) = failures(project)
    assert "in 12 minutes" in failed.claim and failed.found == "a number that no claim accounts for"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (None, "does not exist: make study"),
        ("heart,inside\na,1\n", "covered"),
        ("heart,covered\nx,1\n", "no row"),
    ],
)
def test_a_source_that_gives_no_value_fails_and_says_why(project: Path, table: str | None, said: str) -> None:
    path = project / "results" / "hearts.csv"
    path.unlink() if table is None else path.write_text(table, encoding="utf-8")
    (failed,) = failures(project)
    assert said in failed.found


def test_results_are_asked_of_a_study_in_which_the_claim_holds(project: Path) -> None:
    assert outcomes(project, "none") == [HOLDS, HOLDS, NOT_ASKED]
    assert outcomes(project, "small") == [HOLDS, HOLDS, HOLDS]
    rewrite(project / "claims.yaml", ", holds: any", "")
    assert outcomes(project, "small") == [HOLDS, HOLDS, NOT_ASKED]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{ of: study, value", "{ of: stuby, value", "no source is called 'stuby'"),
        ("the true value in {} of\n", "the true value in 3 of\n", "has 0 holes and 1 values"),
        ("by: sum }\n      - { of: hearts, value: covered, by: count }", "by: most }", "by"),
        ("no_claims: []", "no_claims: []\nmore: 1", "more"),
    ],
)
def test_a_manifest_that_is_wrong_is_refused(project: Path, old: str, new: str, said: str) -> None:
    rewrite(project / "claims.yaml", old, new)
    with pytest.raises(ArtefactError, match=said):
        read_manifest(project / "claims.yaml")


def test_quotations_are_found_over_line_ends() -> None:
    (place,) = quotations("is −{} in {} of", "It is −0.84\nin  fifty of all, 1,000 times")
    assert place.numbers == ("0.84", "fifty")
    assert [value_of(text) for text in ("−0.84", "1,000", "Fifty")] == [-0.84, 1000.0, 50.0]
    assert [round(rounding(text), 6) for text in ("12", "0.84", "1,000")] == [0.5, 0.005, 0.5]


def test_code_links_names_and_marked_parts_hold_no_numbers() -> None:
    text = "BSD-3-Clause `5` [six](page7.md) HDF5 k_0\n```\n8\n```\n<!-- begin x -->\n9\n<!-- end x -->\n"
    assert [(line, around[:30]) for line, around in unaccounted(text, [])] == [(1, text[:30])]


def test_failures_head_the_table() -> None:
    table = table_of([Finding(HOLDS, "a", "b"), Finding(NOT_ASKED, "a", "b"), Finding(FAILS, "c", "d")])
    assert table["outcome"].tolist() == [FAILS, HOLDS, NOT_ASKED] and tuple(table.columns) == COLUMNS
