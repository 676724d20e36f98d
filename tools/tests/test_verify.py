"""`verify`: the generated parts and the claims beside a finished study's results; one changed value fails."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy

from swesbi.artefacts import ArtefactError
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from tools.claims.findings import FAILS, HOLDS, NOT_ASKED, Finding
from tools.claims.parts import parts_judged
from tools.docs.__main__ import write_docs
from tools.docs.pages import stored_pages, study_pages, together
from tools.verify import main

SMOKE = Path("smoke.yaml")
DOCS = Path("docs")


def stored_findings() -> list[Finding]:
    study = load_study(read_merged(Path("config.yaml"), None), "config.yaml")
    return list(parts_judged(stored_pages(study, DOCS), DOCS))


def failed(findings: list[Finding]) -> list[Finding]:
    return [each for each in findings if each.outcome == FAILS]


def test_parts_of_stored_tables_are_what_is_generated_now(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = stored_findings()
    assert failed(found) == []
    names = {each.where.split(":")[0] for each in found if each.outcome == HOLDS}
    pages = ("population", "settings")
    assert names == {f"docs/{page}.md" for page in pages}


def test_a_stored_table_with_one_other_value_fails_on_each_page_that_shows_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("config.yaml", "README.md"):
        shutil.copyfile(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / "config", tmp_path / "config")
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("*.png"))
    shutil.copytree(ROOT / "data" / "virtual_volunteers", tmp_path / "data" / "virtual_volunteers")
    monkeypatch.chdir(tmp_path)
    path = DOCS / "tables" / "gated_as_pushes.csv"
    table = pd.read_csv(path)
    table.loc[table["c2st"].idxmax(), "c2st"] += 0.1
    table.to_csv(path, index=False)
    told = failed(stored_findings())
    assert {each.where.split(":")[0] for each in told} == {"docs/population.md"}
    assert any("0.555 at most" in each.expected and "0.655 at most" in each.found for each in told)


def of_the_small_study(study: StudyCopy) -> None:
    """Put README and documentation beside a study, written from its results."""
    shutil.copyfile(ROOT / "README.md", study.folder / "README.md")
    shutil.copytree(ROOT / "docs", study.folder / "docs", dirs_exist_ok=True)
    write_docs(Path("config.yaml"), SMOKE, DOCS)


def small_findings() -> list[Finding]:
    study = load_study(read_merged(Path("config.yaml"), SMOKE), "config.yaml")
    return list(parts_judged(together(study_pages(study, DOCS), stored_pages(study, DOCS)), DOCS))


@pytest.mark.slow(minutes=1)
def test_one_changed_value_of_the_results_fails(
    own_study: StudyCopy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(own_study.folder)
    of_the_small_study(own_study)
    found = small_findings()
    assert failed(found) == [] and NOT_ASKED not in {each.outcome for each in found}
    path = own_study.results / "tables" / "ppc.csv"
    table = pd.read_csv(path)
    row = table.index[(table["experiment"] == "paper") & table["may_be_read"]][0]
    table.loc[row, "rmse_kpa"] += 0.1
    table.to_csv(path, index=False)
    told = failed(small_findings())
    assert "docs/reproduction.md" in {each.where.split(":")[0] for each in told}
    assert all(each.expected != each.found for each in told)


@pytest.mark.slow(minutes=0.5)
def test_claims_that_hold_of_any_study_hold_of_the_small_one(
    finished: StudyCopy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    overlay = tmp_path / "small.yaml"
    text = (ROOT / "tests" / "smoke.yaml").read_text(encoding="utf-8")
    overlay.write_text(
        text.replace("results: results-smoke", f"results: {finished.results}"), encoding="utf-8"
    )
    out = tmp_path / "claims.csv"
    assert main(["--study", "small", "--overlay", str(overlay), "--out", str(out)]) == 0
    table = pd.read_csv(out, dtype=str).fillna("")
    assert f"{(table['outcome'] == HOLDS).sum()} holds, 0 FAILS" in capsys.readouterr().out
    assert "holds" in set(table["outcome"][table["source"].str.startswith("results/tables/features.csv")])


def test_a_study_that_has_not_finished_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    overlay = tmp_path / "nowhere.yaml"
    overlay.write_text(f"results: {tmp_path / 'nowhere'}\n", encoding="utf-8")
    with pytest.raises(ArtefactError, match="finish the study first"):
        main(["--overlay", str(overlay)])
