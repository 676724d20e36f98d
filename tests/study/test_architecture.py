"""The packages stand on one another in one direction, and no file needs itself through others."""

import ast
import functools
import pkgutil
import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from study_copy import ROOT

import swesbi

SOURCE = Path(swesbi.__file__).parent
LAYERS = (
    "__init__", "base", "seeds", "draws", "parameters", "artefacts", "context", "prior", "heart", "recording",
    "measurement", "networks", "population", "virtual", "posterior", "verdict", "persons", "checks", "config",
    "report", "answers", "study", "interface", "__main__",
)  # fmt: skip
"""From the lowest package to the highest, as CONTRIBUTING.md lists them: each may import those before it."""
BESIDE = ("explorer", "studies")
"""Packages that take names of the study, which runs without them; either may be missing."""
MAKERS = "data"
"""The package of the programs that made the shipped data: it takes names of the study, which runs without."""
PANDAS_READERS = ("read_csv", "read_table", "read_fwf", "read_excel")
STATEMENT = re.compile(r"^ *(?:from|import) +([\w.]+)(?: +import +(.+))?$", re.MULTILINE)


def modules() -> dict[str, Path]:
    """Return every file of the package by its dotted name, a package by its own."""
    files = {path.relative_to(SOURCE).with_suffix("").parts: path for path in SOURCE.rglob("*.py")}
    return {
        ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts): path
        for parts, path in files.items()
    }


MODULES = modules()


@functools.cache
def imported(name: str) -> set[str]:
    """Return the files that one imports anywhere; the facade of all, which loads names when asked, none."""
    if name == "__init__":
        return set()
    tree = ast.parse(MODULES[name].read_text(encoding="utf-8"))
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    return {
        target
        for node in nodes
        if node.module.split(".")[0] == "swesbi"
        for alias in node.names
        if (target := file_of(node.module, alias.name)) != name
    }


def file_of(module: str, name: str) -> str:
    inner = module.removeprefix("swesbi").removeprefix(".")
    submodule = f"{inner}.{name}".removeprefix(".")
    return submodule if submodule in MODULES else inner or "__init__"


def layer(name: str) -> int:
    return LAYERS.index(name.split(".")[0])


def test_a_file_imports_none_of_a_higher_package() -> None:
    assert {name.split(".")[0] for name in MODULES} == set(LAYERS)
    above = {name: sorted(t for t in imported(name) if layer(t) > layer(name)) for name in MODULES}
    assert {name: targets for name, targets in above.items() if targets} == {}


def test_no_circle_between_files() -> None:
    graph = {name: imported(name) for name in MODULES}
    facades = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    # a package's facade imports its files, and they do not go through it
    through = [name for name in MODULES for facade in facades & graph[name] if name.startswith(f"{facade}.")]
    assert through == []
    TopologicalSorter(graph).prepare()  # raises CycleError, with the files of the circle


def code_below(*folders: str) -> list[Path]:
    endings = ("*.py", "*.smk", "Snakefile")
    return [path for name in folders for ending in endings for path in (ROOT / name).rglob(ending)]


def names_imported(path: Path) -> Iterator[str]:
    """Yield the dotted names that a file imports; one of Snakemake, which is no Python, is read by line."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        for module, names in STATEMENT.findall(text):
            yield from (f"{module}.{name.strip()}" for name in names.split(","))
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            yield from (f"{module}{alias.name}" for alias in node.names)


def test_own_tables_are_read_by_one_function() -> None:
    """pandas by itself takes a subject called NA for a missing one and 007 for 7; that function does not."""
    read = {
        name
        for name, path in MODULES.items()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.Attribute) and node.attr in PANDAS_READERS)
        or (isinstance(node, ast.ImportFrom) and node.module == "pandas")
    }
    assert read == {"artefacts.csv"}
    rules = "\n".join(path.read_text(encoding="utf-8") for path in code_below("workflow"))
    assert not [name for name in PANDAS_READERS if name in rules]


def test_what_benchmarks_import_of_the_study_is_there() -> None:
    """No test runs them, so a name that is changed is missed where they are next wanted."""
    used = {name for path in code_below("benchmarks") for name in names_imported(path)}
    found = {name for name in used if name.startswith("swesbi.")}
    assert len(found) > 50
    for name in sorted(found):
        assert pkgutil.resolve_name(name) is not None, name


@pytest.mark.parametrize(
    ("folders", "beside"),
    [(("src", "workflow", "tests", "benchmarks"), BESIDE), (("src", "workflow", *BESIDE), (MAKERS,))],
)
def test_nothing_imports_what_it_runs_without(folders: tuple[str, ...], beside: tuple[str, ...]) -> None:
    """The study runs without what stands beside it, and no stage of either needs what made the data."""
    files = [ROOT / "Snakefile", *code_below(*folders)]
    assert len(files) > 300
    if MAKERS in beside:
        files = [path for path in files if "tests" not in path.relative_to(ROOT).parts]
    found = {(path, name) for path in files for name in names_imported(path)}
    assert {(path, name) for path, name in found if name.split(".")[0] in beside} == set()
