"""The packages stand on one another in one direction, and no file needs itself through others."""

import ast
import functools
from graphlib import TopologicalSorter
from pathlib import Path

import swesbi

SOURCE = Path(swesbi.__file__).parent
LAYERS = (
    "__init__",
    "base",
    "arrays",
    "seeds",
    "evolution",
    "progress",
    "syntax",
    "definitions",
    "code_hash",
    "translation",
    "draws",
    "parameters",
    "artefacts",
    "context",
    "prior",
    "heart",
    "recording",
    "measurement",
    "virtual_cohort",
    "simulations",
    "networks",
    "population",
    "posterior",
    "hierarchy",
    "verdict",
    "change",
    "planning",
    "checks",
    "exam",
    "config",
    "virtual_trial",
    "show",
    "explorer",
    "study",
    "__main__",
)
"""From the lowest package to the highest, as CONTRIBUTING.md lists them: each may import those before it."""


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
    """Return the files that one imports anywhere, also inside functions and for types alone."""
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


def test_every_package_has_its_layer() -> None:
    assert {name.split(".")[0] for name in MODULES} == set(LAYERS)


def test_a_file_imports_none_of_a_higher_package() -> None:
    above = {name: sorted(t for t in imported(name) if layer(t) > layer(name)) for name in MODULES}
    assert {name: targets for name, targets in above.items() if targets} == {}


def test_no_circle_between_files() -> None:
    graph = {name: imported(name) for name in MODULES}
    facades = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    # a package's facade imports its files, and they do not go through it
    assert [
        name for name in MODULES for facade in facades & graph[name] if name.startswith(f"{facade}.")
    ] == []
    TopologicalSorter(graph).prepare()  # raises CycleError, with the files of the circle
