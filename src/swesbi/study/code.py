"""A hash of the code that a stage runs: the definitions of this package that its function leads to.

A definition counts by its text and by what it names, wherever that lies. Its text is that without docstrings,
comments, layout and descriptions of settings; a text that names a module counts as the whole of it. Names are
resolved by module, not by scope: a local variable that is called as a definition of its module names it.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Final

Place = tuple[str, str]
"""Where a definition lies: its module, and its name there."""
Chain = tuple[str, ...]
"""A module, a name in it, attributes."""
EFFECTS: Final = ""
"""Stands for the name of all that a module does when it is imported, beside binding names."""
WHOLE: Final = "*"
"""Stands for the name of a whole module."""
REFUSED: Final = frozenset(("exec", "globals", "locals", "__subclasses__"))
FIELD: Final = ("pydantic", "Field")
DATA_FILE: Final = re.compile(r"\w[\w/-]*\.(?!py\b)\w[\w.]*")


class Packages:
    """The sources of packages that lead to each other, by the folders' names, read as they are needed."""

    def __init__(self, *folders: Path) -> None:
        self.folders = {folder.name: folder for folder in folders}
        self.source, self.file_of = cache(self._source), cache(self._file_of)
        self.linked = cache(self._linked)

    def hash(self, module: str, name: str) -> str:
        """Return 16 hexadecimal digits that name the code that a function leads to.

        A ValueError names code that it leads to and that cannot be followed.
        """
        links = {place: self.linked(place) for place in self.followed(module, name)}
        labels, parted = {place: text for place, (_, text) in links.items()}, 0
        # definitions of equal text part where something that they name differs, until none parts any more
        while parted < (parted := len(set(labels.values()))):
            labels = {
                place: hashlib.sha256(text + b"".join(sorted(labels[each] for each in targets))).digest()
                for place, (targets, text) in links.items()
            }
        whole = labels[module, name] + b"".join(sorted(set(labels.values())))
        return hashlib.sha256(whole).hexdigest()[:16]

    def settings(self, module: str, name: str) -> list[str]:
        """Return the keyword-only arguments of a function that have no default."""
        for node in self.source(module).bound.get(name, []):
            if isinstance(node, ast.FunctionDef):
                named = zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)
                return [argument.arg for argument, default in named if default is None]
        raise AttributeError(f"{module} has no function {name!r}")

    def followed(self, module: str, name: str) -> set[Place]:
        """Return the definitions that a function leads to, its own included."""
        if name not in self.source(module).bound:
            raise AttributeError(f"{module} defines no {name!r}")
        places: set[Place] = set()
        pending = {(module, name)}
        while pending:
            places |= pending
            pending = {each for place in pending for each in self.linked(place)[0]} - places
        return places

    def _linked(self, place: Place) -> tuple[frozenset[Place], bytes]:
        """Return the places that a definition leads to, and a digest of what it says itself."""
        source, passed = self.source(place[0]), {place[0]}
        every = [(place[0], name) for name in source.bound] if place[1] == WHOLE else []
        found = {chain: self._resolved(chain, passed) for chain in (*source.chains(place[1]), *every)}
        around = {".".join(each.split(".")[:n]) for each in passed for n in range(1, each.count(".") + 2)}
        effects = {(each, EFFECTS) for each in around if EFFECTS in self.source(each).bound}
        foreign = sorted(".".join(chain) for chain, target in found.items() if target is None)
        text = hashlib.sha256(source.text(place[1]) + "\n".join(foreign).encode()).digest()
        return frozenset({*filter(None, found.values()), *effects} - {place}), text

    def _resolved(self, chain: Chain, passed: set[str]) -> Place | None:
        """Return where a chain leads, None outside the packages; note the modules that it passes."""
        module, *rest = chain
        if module.partition(".")[0] not in self.folders or not (rest or self.file_of(module)):
            return None
        source, first = self.source(module), rest[0] if rest else WHOLE
        passed.add(module)
        if first in source.bound:
            return module, first
        if first in source.imports:
            return self._resolved((*source.imports[first], *rest[1:]), passed)
        below = f"{module}.{first}"
        return self._resolved((below, *rest[1:]), passed) if self.file_of(below) else (module, WHOLE)

    def _source(self, module: str) -> Source:
        if path := self.file_of(module):
            return Source(module, path)
        raise ModuleNotFoundError(f"there is no module {module!r}")

    def _file_of(self, module: str) -> Path | None:
        package, *below = module.split(".")
        base = self.folders[package].joinpath(*below)
        return next(filter(Path.is_file, (base / "__init__.py", base.with_suffix(".py"))), None)


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
        """Yield what a definition names."""
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
    """Return what each name that an import binds stands for."""
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
