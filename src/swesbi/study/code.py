"""A hash of the code that a stage runs: the definitions of this package that its function leads to.

A definition counts by its text and by what it names, wherever that lies. A text that names a module counts as
the whole of it.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from swesbi.study.source import EFFECTS, WHOLE, Chain, Source

Place = tuple[str, str]
"""Where a definition lies: its module, and its name there."""


class Packages:
    """The sources of packages that lead to each other, by the folders' names, read as they are needed."""

    def __init__(self, *folders: Path) -> None:
        self.folders = {folder.name: folder for folder in folders}
        self.source, self.file_of = cache(self._source), cache(self._file_of)
        self.linked = cache(self._linked)

    def hash(self, module: str, name: str) -> str:
        """Return 16 hexadecimal digits that name the code that a function leads to.

        Raises:
            ModuleNotFoundError, AttributeError: There is no such module, or it defines no such name.
            ValueError: Code that it leads to cannot be followed.
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
        """Return the keyword-only arguments of a function that have no default; errors as of :meth:`hash`."""
        for node in self.source(module).bound.get(name, []):
            if isinstance(node, ast.FunctionDef):
                named = zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)
                return [argument.arg for argument, default in named if default is None]
        raise AttributeError(f"{module} has no function {name!r}")

    def followed(self, module: str, name: str) -> set[Place]:
        """Return the definitions that a function leads to, its own included; errors as of :meth:`hash`."""
        if name not in self.source(module).bound:
            raise AttributeError(f"{module} defines no {name!r}")
        places: set[Place] = set()
        pending = {(module, name)}
        while pending:
            places |= pending
            pending = {each for place in pending for each in self.linked(place)[0]} - places
        return places

    def lines(self, places: Iterable[Place]) -> set[tuple[str, int]]:
        """Return the lines of definitions, with their decorators: module and number."""
        tops = [(module, top) for module, name in places for top in self.source(module).bound.get(name, [])]
        return {
            (module, line)
            for module, top in tops
            for part in (top, *getattr(top, "decorator_list", []))
            for line in range(part.lineno, (part.end_lineno or 0) + 1)
        }

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
