"""A hash of the code that a stage runs: its module and everything that it imports from the package.

Snakemake does not notice edits of an installed package. Rules therefore carry this hash as a parameter:
editing the code of a stage reruns the stage, while comments, formatting and docstrings do not count.
Package ``__init__`` files count where a name is imported through them, since that is where it leads.
Data files of the package (templates, tables of values) count for the modules that name them in a string,
by their path from the module's folder.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = "swesbi"
SOURCE = Path(__file__).parent
DATA_FILE = re.compile(r"\w[\w/-]*\.(?!py\b)\w[\w.]*")


def stage_hash(module: str) -> str:
    """Return 16 hexadecimal digits that name the code of ``module`` (``swesbi.stages.pool``, say).

    Raises:
        ModuleNotFoundError: The package has no such module.
    """
    digest = hashlib.sha256()
    for name in sorted(imported_modules(module)):
        digest.update(f"{name}\n{_meaning(_path(name))}\n".encode())
        for path in data_files(name):
            digest.update(path.name.encode() + b"\n" + path.read_bytes())
    return digest.hexdigest()[:16]


def imported_modules(module: str) -> set[str]:
    """Return ``module`` and every module of the package that it imports, directly or not."""
    found: set[str] = set()
    pending = [module]
    while pending:
        name = pending.pop()
        if name not in found:
            found.add(name)
            pending.extend(_imports(name))
    return found


def data_files(module: str) -> tuple[Path, ...]:
    """Return the data files of the package that a module names in a string, as ``page.css`` beside it."""
    folder = _path(module).parent
    named = {folder / text for text in _texts(module) if DATA_FILE.fullmatch(text)}
    return tuple(sorted(path for path in named if path.is_file()))


@cache
def _texts(module: str) -> frozenset[str]:
    tree = ast.parse(_path(module).read_text(encoding="utf-8"))
    return frozenset(
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


@cache
def _imports(module: str) -> tuple[str, ...]:
    tree = ast.parse(_path(module).read_text(encoding="utf-8"))
    return tuple(name for node in ast.walk(tree) for name in _targets(node))


def _targets(node: ast.AST) -> Iterator[str]:
    """Yield the package's modules that one import statement reaches."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if _is_module(alias.name))
    elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
        submodules = [f"{node.module}.{alias.name}" for alias in node.names]
        named = [name for name in submodules if _is_module(name)]
        yield from named
        if len(named) < len(submodules) and _is_module(node.module):
            yield node.module


def _is_module(name: str) -> bool:
    if name.split(".", maxsplit=1)[0] != PACKAGE:
        return False
    try:
        _path(name)
    except ModuleNotFoundError:
        return False
    return True


def _path(module: str) -> Path:
    base = SOURCE.joinpath(*module.split(".")[1:])
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    raise ModuleNotFoundError(f"the package has no module {module!r}")


@cache
def _meaning(path: Path) -> str:
    """Return the syntax tree without docstrings, as text."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [statement for statement in node.body if not _is_text(statement)]
    return ast.dump(tree)


def _is_text(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )
