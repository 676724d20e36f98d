"""A finished study as an RO-Crate: what it describes is there, the same files give the same bytes; valid."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rocrate import vocabs
from rocrate_validator import models, services
from rocrate_validator.utils.http import HttpRequester
from study_copy import ROOT

from tools.crate import CODE_LICENCE, DATA_LICENCE, PROFILES, main

FILES = (
    "Snakefile", "config.yaml", "environment.txt", "pyproject.toml", "README.md", "LICENSE", "CITATION.cff",
    "data/LICENSE",
)  # fmt: skip
CONTEXT = "https://w3id.org/ro/crate/1.1/context"
TERMS = {  # that mean something else in the newer context
    "ComputationalWorkflow": "https://bioschemas.org/ComputationalWorkflow",
    "FormalParameter": "https://bioschemas.org/FormalParameter",
    "input": "https://bioschemas.org/ComputationalWorkflow#input",
    "output": "https://bioschemas.org/ComputationalWorkflow#output",
}


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The project with results as a finished study leaves them, but few."""
    (tmp_path / "data").mkdir()
    for name in FILES:
        shutil.copyfile(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / "workflow", tmp_path / "workflow")
    shutil.copytree(ROOT / "data" / "virtual_volunteers", tmp_path / "data" / "virtual_volunteers")
    package = tmp_path / "src" / "swesbi"
    (package / "__pycache__").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "__pycache__" / "x.pyc").write_bytes(b"1")
    for name in ("tables/ppc.csv", "tables/ppc.tex", "figures/ppc.png", "index.html"):
        path = tmp_path / "results" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name, encoding="utf-8")
    shutil.copyfile(ROOT / "config.yaml", tmp_path / "results" / "configuration.yaml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def packed(project: Path) -> Path:
    assert main(["results"]) == 0
    return project / "results" / "crate"


def graph(crate: Path) -> dict[str, dict[str, Any]]:
    metadata = json.loads((crate / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    assert metadata["@context"] == CONTEXT
    entities = {entity["@id"]: entity for entity in metadata["@graph"]}
    assert len(entities) == len(metadata["@graph"])
    return entities


def kinds(entity: dict[str, Any]) -> set[str]:
    kind = entity["@type"]
    return {kind} if isinstance(kind, str) else set(kind)


def ids(value: object) -> set[str]:
    return {each["@id"] for each in (value if isinstance(value, list) else [value])}


def files_below(folder: Path) -> dict[str, bytes]:
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def test_what_is_described_is_there_and_what_is_there_is_described(project: Path) -> None:
    crate = packed(project)
    entities, files = graph(crate), files_below(crate)
    named = {name for name, entity in entities.items() if "File" in kinds(entity)}
    assert named <= set(files)
    others = set(files) - named - {"ro-crate-metadata.json"}
    assert others and all(name.startswith(("workflow/", "src/")) for name in others)
    assert not any("__pycache__" in name for name in files)
    assert all(files[name] == (project / name).read_bytes() for name in named)
    assert all(int(entities[name]["contentSize"]) == len(files[name]) for name in named - {"Snakefile"})


def test_the_workflow_made_the_results_of_the_recordings(project: Path) -> None:
    entities = graph(packed(project))
    root, run = entities["./"], entities["#run"]
    assert ids(root["mainEntity"]) == ids(run["instrument"]) == {"Snakefile"}
    assert kinds(entities["Snakefile"]) == {"File", "SoftwareSourceCode", "ComputationalWorkflow"}
    assert {
        "config.yaml",
        "results/configuration.yaml",
        "data/virtual_volunteers/subjects.csv",
        "data/virtual_volunteers/swe/A.csv",
    } <= ids(run["object"])
    assert {"results/index.html", "results/tables/ppc.csv", "results/figures/ppc.png"} <= ids(run["result"])
    assert ids(root["conformsTo"]) == set(PROFILES)


def test_only_recordings_that_are_shipped_have_the_licence_of_the_shipped_ones(project: Path) -> None:
    shipped = graph(packed(project))
    assert shipped["data/virtual_volunteers/swe/A.csv"]["license"] == {"@id": DATA_LICENCE}
    shutil.copytree(project / "data" / "virtual_volunteers", project / "data" / "own")
    (project / "results" / "configuration.yaml").write_text("cohort: data/own\n", encoding="utf-8")
    own = graph(packed(project))
    assert "license" not in own["data/own/swe/A.csv"] and "license" not in own["results/tables/ppc.csv"]
    assert own["config.yaml"]["license"] == {"@id": CODE_LICENCE} and DATA_LICENCE not in own


def test_the_same_files_give_the_same_bytes_without_a_place_or_a_time(project: Path) -> None:
    first = files_below(packed(project))
    for path in project.rglob("*"):
        path.touch()
    assert files_below(packed(project)) == first
    metadata = first["ro-crate-metadata.json"].decode("utf-8")
    assert str(project) not in metadata and "T00:" not in metadata


def test_a_file_from_elsewhere_and_an_unfinished_study_are_refused_and_the_former_crate_stays(
    project: Path, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    before = files_below(packed(project))
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "subjects.csv").write_text("subject\n", encoding="utf-8")
    merged = project / "results" / "configuration.yaml"
    merged.write_text(f"cohort: {elsewhere}\n", encoding="utf-8")
    assert main(["results"]) == 2
    assert "lies outside of" in capsys.readouterr().err
    (project / "results" / "index.html").unlink()
    assert main(["results"]) == 2
    assert "results/index.html does not exist: finish the study first" in capsys.readouterr().err
    assert files_below(project / "results" / "crate") == before


class Shipped:
    """Answers the one request that validation makes, for the context, from the copy that rocrate ships."""

    def get(self, url: str, **_: object) -> SimpleNamespace:
        assert url == CONTEXT
        body = {"@context": {**vocabs.RO_CRATE["@context"], **TERMS}}
        headers = {"Content-Type": "application/ld+json"}
        return SimpleNamespace(status_code=200, headers=headers, json=lambda: body, text=json.dumps(body))


def issues(crate: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.setattr(HttpRequester, "__getattr__", lambda _, name: getattr(Shipped(), name))
    settings = services.ValidationSettings(
        rocrate_uri=str(crate),
        profile_identifier="workflow-run-crate-0.5",
        requirement_severity=models.Severity.REQUIRED,
        offline=True,
    )
    return [issue.message for issue in services.validate(settings).get_issues()]


def test_the_crate_is_valid_by_its_profiles_and_not_without_a_workflow(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crate = packed(project)
    assert issues(crate, monkeypatch) == []
    path = crate / "ro-crate-metadata.json"
    metadata = json.loads(path.read_text(encoding="utf-8"))
    run = next(entity for entity in metadata["@graph"] if entity["@id"] == "#run")
    del run["instrument"]
    path.write_text(json.dumps(metadata), encoding="utf-8")
    assert any("instrument" in message for message in issues(crate, monkeypatch))
