"""The documentation's marked parts come from a finished study, and nothing else of the page changes."""

from __future__ import annotations

import contextlib
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy

from swesbi.config.read import overlay, read_merged, read_yaml
from swesbi.config.study import Study, load_study
from swesbi.report.page.figures import PagePart
from swesbi.report.tables.population import OverPopulation
from swesbi.verdict.verdict import read_verdict
from tools.docs.__main__ import documented, main
from tools.docs.marks import PART, MarkError, fill
from tools.docs.population import PopulationResults, scaling_part
from tools.docs.reproduction import PARTS, truth_part
from tools.docs.results import ReproductionResults, read_results
from tools.docs.statements import statements_part

SHIPPED = (ROOT / "docs" / "reproduction.md").read_text(encoding="utf-8")


def study_of(finished: StudyCopy) -> Study:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(finished.folder)
        config = overlay(
            read_merged(finished.folder / "config.yaml"), read_yaml(finished.folder / "smoke.yaml")
        )
        study = load_study(config)
    cohort = str(finished.folder / study.config.cohort)
    listed = {
        name: part.model_copy(update={"subjects": study.subjects_of(name)})
        for name, part in study.config.experiments.items()
    }
    return replace(study, config=study.config.model_copy(update={"cohort": cohort, "experiments": listed}))


@pytest.fixture(scope="module")
def results(finished: StudyCopy) -> ReproductionResults:
    return read_results(finished.results, study_of(finished), finished.folder / "docs")


@pytest.fixture(scope="module")
def written(finished: StudyCopy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages, filled from the finished study; tests only read them."""
    docs = tmp_path_factory.mktemp("written") / "docs"
    docs.mkdir()
    for page in (
        "reproduction.md",
        "calibration.md",
        "population.md",
    ):
        (docs / page).write_text((ROOT / "docs" / page).read_text(encoding="utf-8"), encoding="utf-8")
    with contextlib.chdir(finished.folder):
        assert main(["--overlay", "smoke.yaml", "--docs", str(docs)]) == 0
    return docs


def parts_of(page: str) -> dict[str, str]:
    return {match["name"]: match["body"] for match in PART.finditer(page)}


def test_every_part_stands_on_the_page() -> None:
    assert sorted(parts_of(SHIPPED)) == sorted(PARTS)
    assert all(body.strip() for body in parts_of(SHIPPED).values()), "run `make docs` after `make study`"


def test_parts_are_reproduced_and_prose_is_kept(written: Path, results: ReproductionResults) -> None:
    page = (written / "reproduction.md").read_text(encoding="utf-8")
    assert {name: body.strip() for name, body in parts_of(page).items()} == {
        name: part(results).strip() for name, part in PARTS.items()
    }
    assert PART.sub("", page) == PART.sub("", SHIPPED)
    assert fill(page, {name: part(results) for name, part in PARTS.items()}) == page


def test_parts_hold_the_numbers_of_the_study(written: Path, finished: StudyCopy) -> None:
    parts = parts_of((written / "reproduction.md").read_text(encoding="utf-8"))
    scores = pd.read_csv(finished.results / "tables" / "ppc.csv")
    for row in scores[scores["experiment"] == "paper"].itertuples():
        verdict = read_verdict(finished.results / "paper" / "subjects" / row.subject / "verdict.json")
        status = "prior-supported" if row.may_be_read else "not prior-supported"
        assert re.search(
            rf"^\| {row.subject} \| {status} \| {verdict.max_abs_z:.2f} \|",
            parts["support"],
            re.MULTILINE,
        )
        shown = re.search(rf"^\| {row.subject} \| .*$", parts["scores"], re.MULTILINE)
        assert shown is not None
        if row.may_be_read:
            assert f"| {row.rmse_prior_kpa:.2f} | {row.rmse_kpa:.2f} |" in shown[0]
    recovery = pd.read_csv(finished.results / "paper" / "recovery.csv").query("nominal == 0.9")
    assert all(f"| {100 * value:.1f} (" in parts["recovery"] for value in recovery["coverage"])
    epochs = pd.read_csv(finished.results / "paper" / "epochs.csv")
    shown_epochs = {
        epochs["epoch"].min(),
        epochs["epoch"][epochs["best"] == 1].iloc[0],
        epochs["epoch"].max(),
    }
    rows = [line for line in parts["epochs"].splitlines() if line.startswith("|")]
    assert len(rows) == 2 + len(shown_epochs)


def test_a_statement_without_its_number_is_refused(results: ReproductionResults) -> None:
    with pytest.raises(ValueError, match="no number that begins 'subjects that pass'"):
        statements_part(replace(results, comparison=results.comparison.iloc[-1:]))


def test_figures_are_those_of_the_study(written: Path, finished: StudyCopy) -> None:
    for name in documented(PagePart.STUDY):
        copied = written / "figures" / f"{name}.png"
        assert copied.read_bytes() == (finished.results / "figures" / f"{name}.png").read_bytes()


def test_the_cost_of_cohorts_is_shown_with_its_growth() -> None:
    cost = {("population_answers", 6): 40.0, ("population_answers", 60): 400.0, ("planning", 6): 4.0}
    rows = [(stage, size, cpu_s) for (stage, size), cpu_s in (cost | {("planning", 60): 5.0}).items()]
    scaling = pd.DataFrame(rows, columns=["stage", "subjects", "cpu_s"])
    nothing = OverPopulation("amortised", {}, 0.9, scaling, scaling)
    part = scaling_part(PopulationResults(nothing, "x", scaling))
    assert "| population answers | 40 | 400 | 1.00 |" in part
    assert "planning" not in part


def test_true_parameters_are_counted(results: ReproductionResults) -> None:
    assert results.supported, "needs a supported subject"
    text = truth_part(results)
    shown = int(re.match(r"True parameters inside .*: (\d+) of", text)[1])
    inside = 0
    for name in results.supported:
        own = results.main.posterior[results.main.posterior["subject"] == name].set_index("parameter")
        for value, parameter in zip(
            results.true_theta[name], ("k0_kpa", "k_atp_per_s", "k_sr_per_s"), strict=True
        ):
            inside += own["ci_low"][parameter] <= value <= own["ci_high"][parameter]
    assert shown == inside
    assert "no known true parameters" in truth_part(replace(results, true_theta={}))


def test_a_study_without_supported_subjects_can_be_shown(results: ReproductionResults) -> None:
    none = "not prior-supported"
    nobody = {name: replace(verdict, status=none) for name, verdict in results.verdicts.items()}
    scores = results.main.scores.assign(may_be_read=False)
    main = replace(results.main, verdicts=nobody, scores=scores)
    others = [each for each in results.experiments if each is not results.main]
    for name, part in PARTS.items():
        assert "nan" not in part(replace(results, main=main, experiments=(main, *others))), name


def test_an_unfinished_study_is_named(
    finished: StudyCopy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(finished.folder)
    (tmp_path / "reproduction.md").write_text(SHIPPED, encoding="utf-8")
    (tmp_path / "changes.yaml").write_text("results: nowhere\n")
    assert main(["--overlay", str(tmp_path / "changes.yaml"), "--docs", str(tmp_path)]) == 2
    assert "does not exist: finish the study first" in capsys.readouterr().err
    assert (tmp_path / "reproduction.md").read_text(encoding="utf-8") == SHIPPED


def test_parts_of_stored_tables_are_written_without_a_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is shipped is what is written; a part of a study stays as it stands."""
    monkeypatch.chdir(ROOT)
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    (tmp_path / "changes.yaml").write_text(f"results: {tmp_path / 'nowhere'}\n")
    population, calibration = (tmp_path / "docs" / name for name in ("population.md", "calibration.md"))
    text = population.read_text(encoding="utf-8")
    assert "gated recordings given as pushes" in text
    spoilt = text.replace("gated recordings given as pushes", "recordings given as nothing")
    population.write_text(spoilt, encoding="utf-8")
    given = ("--overlay", str(tmp_path / "changes.yaml"), "--docs", str(tmp_path / "docs"))
    assert main([*given, "--stored"]) == 0
    for path in (population, calibration):
        shipped = ROOT / path.relative_to(tmp_path)
        assert path.read_text(encoding="utf-8") == shipped.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("page", "message"),
    [
        ("<!-- begin run -->\n", "'run' has no partner"),
        ("<!-- begin run -->\n<!-- end scores -->", "has no partner"),
        ("<!-- begin other -->\n<!-- end other -->", "no part is called 'other'"),
    ],
)
def test_marks_that_do_not_fit_are_refused(page: str, message: str) -> None:
    with pytest.raises(MarkError, match=message):
        fill(page, {"run": "text", "scores": "text"})
