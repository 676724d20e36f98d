"""A module's source: the statements that bind each of its names, and what each of them says and names.

A definition's text is that without docstrings, comments, layout and descriptions of settings. Names are
resolved by module, not by scope: a local variable that is called as a definition of its module names it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

Chain = tuple[str, ...]
"""A module, a name in it, attributes."""
EFFECTS: Final = ""
"""Stands for the name of all that a module does when it is imported, beside binding names."""
WHOLE: Final = "*"
"""Stands for the name of a whole module."""
REFUSED: Final = frozenset(("exec", "globals", "locals", "__subclasses__"))
FIELD: Final = ("pydantic", "Field")
DATA_FILE: Final = re.compile(r"\w[\w/-]*\.(?!py\b)\w[\w.]*")


class Source:
    """The statements that bind each top-level name of a module, and what each imported name stands for."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self.bound: dict[str, list[ast.stmt]] = {}
        self.imports: dict[str, Chain] = {}
        for node in ast.parse(path.read_text(encoding="utf-8"), str(path)).body:
            self._sort(node)

    def _sort(self, node: ast.stmt) -> None:
        condition = ast.unparse(node.test) if isinstance(node, ast.If) else ""
        if isinstance(node, ast.Import | ast.ImportFrom):
            self.imports |= imported(node)
        elif isinstance(node, ast.If) and condition.endswith("TYPE_CHECKING"):
            for part in node.body:
                self._sort(part)
        elif condition != "__name__ == '__main__'" and not _is_text(node):
            self._strip(node)
            for name in self._names(node):
                self.bound.setdefault(name, []).append(node)

    def _strip(self, node: ast.stmt) -> None:
        """Take out docstrings, and descriptions of the fields of settings."""
        for part in ast.walk(node):
            if isinstance(part, ast.FunctionDef | ast.ClassDef):
                part.body = [each for each in part.body if not _is_text(each)]
            elif isinstance(part, ast.Call) and self.imports.get(_dotted(part.func)[0]) == FIELD:
                part.keywords = [each for each in part.keywords if each.arg != "description"]

    def _names(self, node: ast.stmt) -> list[str]:
        """Return the names that a statement binds, with ``EFFECTS`` where it does something else."""
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            package = self.name.partition(".")[0]
            own = {name for name, chain in self.imports.items() if chain[0].partition(".")[0] == package}
            decorators = {_dotted(part)[0] for part in _walk(node.decorator_list)}
            # a decorator of the package may note what it decorates
            return [node.name, *([EFFECTS] if decorators & (own | self.bound.keys()) else [])]
        stored = (
            part for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)
        )
        names = dict.fromkeys(part.id for part in stored)
        plain = names and isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign)
        return [*names, *([] if plain else [EFFECTS])]

    def chains(self, name: str) -> Iterator[Chain]:
        """Yield what a definition names.

        Raises:
            ValueError: It does what cannot be followed.
        """
        parts = list(_walk(self.bound.get(name, [])))
        inner = {id(part.value) for part in parts if isinstance(part, ast.Attribute)}
        for part in parts:
            if isinstance(part, ast.Import | ast.ImportFrom):
                yield from imported(part).values()
            elif isinstance(part, ast.Name | ast.Attribute) and id(part) not in inner:
                first, *rest = _dotted(part)
                if refused := REFUSED & {first, *rest}:
                    raise ValueError(f"{self.path}: {min(refused)} cannot be followed; name what is used")
                if first in self.bound:
                    yield (self.name, first, *rest)
                if first in self.imports:
                    yield (*self.imports[first], *rest)
            elif isinstance(part, ast.Constant) and "." in str(part.value):
                yield (str(part.value),)  # the name of a module, perhaps

    def text(self, name: str) -> bytes:
        """Return what a definition says itself, with the data files that it names."""
        tops = self.bound.get(name, [])
        texts = [part.value for part in _walk(tops) if isinstance(part, ast.Constant)]
        named = sorted({text for text in texts if isinstance(text, str) and DATA_FILE.fullmatch(text)})
        data = [path.read_bytes() for text in named if (path := self.path.parent / text).is_file()]
        return b"\n".join([*(ast.dump(top).encode() for top in tops), *data])


def imported(node: ast.Import | ast.ImportFrom) -> dict[str, Chain]:
    """Return what each name that an import binds stands for.

    Raises:
        ValueError: It is a relative or a star import.
    """
    if isinstance(node, ast.ImportFrom):
        if node.level or node.names[0].name == WHOLE:
            raise ValueError(f"{ast.unparse(node)} cannot be followed; name what is used")
        return {each.asname or each.name: (node.module or "", each.name) for each in node.names}
    return {each.asname or each.name.partition(".")[0]: (each.name,) for each in node.names}


def _walk(tops: Iterable[ast.AST]) -> Iterator[ast.AST]:
    return (part for top in tops for part in ast.walk(top))


def _dotted(part: ast.AST) -> list[str]:
    """Return a name and its attributes; of an attribute of something else an empty name first."""
    if isinstance(part, ast.Attribute):
        return [*_dotted(part.value), part.attr]
    return [part.id if isinstance(part, ast.Name) else ""]


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
