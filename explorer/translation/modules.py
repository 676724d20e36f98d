"""The modules of the packages as syntax trees: what each defines, and what its names stand for."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Final

import swesbi
from explorer.translation import syntax

FOLDERS: Final[Mapping[str, Path]] = {
    "explorer": Path(__file__).resolve().parents[1],
    "swesbi": Path(swesbi.__file__).parent,
}
"""Packages whose definitions are translated: the study's, and this one."""


class Module(syntax.Names):
    """One module, read: its names, and the statement that defines each."""

    def __init__(self, name: str) -> None:
        super().__init__(name, file_of(name), frozenset(FOLDERS))
        self._read(ast.parse(self.path.read_text(encoding="utf-8"), str(self.path)).body)

    def _read(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            if isinstance(statement, ast.Import | ast.ImportFrom):
                self.imports |= self.targets(statement)
            elif isinstance(statement, ast.If) and syntax.is_typing(statement.test):
                self._read(statement.body)
            else:
                for name in syntax.bound_by([statement]):
                    self.bound.setdefault(name, []).append(statement)

    def definition(self, name: str) -> ast.stmt:
        """Return the statement that defines a name; the last of several."""
        return self.bound[name][-1]


def file_of(name: str) -> Path:
    """Return the file of a module of one of the packages."""
    package, *below = name.split(".")
    path = FOLDERS[package].joinpath(*below)
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@lru_cache(maxsize=256)
def module(name: str) -> Module:
    """Return a module of one of the packages."""
    return Module(name)


def resolved(chain: syntax.Chain) -> syntax.Chain:
    """Return the chain of what a name stands for at the place of its definition: module, name, attributes."""
    while chain[0].split(".")[0] in FOLDERS and len(chain) > 1:
        known = module(chain[0])
        if chain[1] in known.bound:
            return chain
        if chain[1] in known.imports:
            chain = (*known.imports[chain[1]], *chain[2:])
        else:  # a module of a package
            chain = (f"{chain[0]}.{chain[1]}", *chain[2:])
    return chain


def value_of(chain: syntax.Chain) -> object:
    """Return what a chain is when its package runs."""
    value: object = importlib.import_module(chain[0])
    for name in chain[1:]:
        value = getattr(value, name)
    return value
