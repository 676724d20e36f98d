"""A hash of the code that a stage runs: its function and every definition of the package that it leads to.

Snakemake does not notice edits of an installed package. Rules therefore carry this hash as a parameter:
editing the code of a stage reruns the stage, while comments, formatting, docstrings and
descriptions of settings do not count.

The hash starts at one function and follows names:

- to functions, classes and constants, through imports, re-exports of a package and modules' attributes.
  A class counts whole, with its bases; a function with its decorators, default values and annotations, those
  in strings included, since annotations name the settings that a stage reads.
- to all of a module where the module itself is used (passed on, searched by ``getattr``), where a string
  has its name, and where its import is all that is wanted: nothing mentions what the import binds. A module
  that imports by names made at run time counts whole, with every module below it.
- What a module does when it is imported - statements that are neither definitions, imports nor assignments to
  names, and definitions with a decorator of the package, which may register them - counts as soon as
  anything of the module, or of one below it, does.
- Data files of the package (templates, tables of values) count for the definitions that name them in a
  string, by their path from the module's folder.

Names of other packages count as names. What no text shows is refused: star imports from the package, ``exec``
and the like. Where a definition lies does not count, so that one can be moved: a name counts as the text of
what it stands for, and that of what this names, and so on.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from swesbi.study.code.definitions import EFFECTS, WHOLE, Definition, Source, read_source
from swesbi.study.code.syntax import Chain


class Place(NamedTuple):
    """Where a definition lies: its module, and its name there."""

    module: str
    name: str


class Packages:
    """The sources of packages that lead to each other, read as they are needed."""

    def __init__(self, *folders: Path) -> None:
        """Take the packages in ``folders``, of the folders' names."""
        self.folders = {folder.name: folder for folder in folders}
        self._files: dict[str, Path | None] = {}
        self._sources: dict[str, Source] = {}
        self._links: dict[Place, tuple[tuple[Place, ...], bytes]] = {}

    def hash(self, module: str, name: str) -> str:
        """Return 16 hexadecimal digits that name the code that a function leads to.

        Raises:
            ModuleNotFoundError: There is no such module.
            AttributeError: The module defines no such name.
            ValueError: Code that it leads to cannot be followed.
        """
        entry = Place(module, name)
        links = {place: self._linked(place) for place in self.followed(module, name)}
        labels = {place: text for place, (_, text) in links.items()}
        while True:
            # definitions of equal text part where something that they name differs, until none parts any more
            finer = {
                place: hashlib.sha256(text + b"".join(labels[target] for target in targets)).digest()
                for place, (targets, text) in links.items()
            }
            if len(set(finer.values())) == len(set(labels.values())):
                break
            labels = finer
        digest = hashlib.sha256(finer[entry] + b"".join(sorted(set(finer.values()))))
        return digest.hexdigest()[:16]

    def followed(self, module: str, name: str) -> set[Place]:
        """Return the definitions that a function leads to, its own included.

        Raises:
            As ``hash``.
        """
        if name not in self._source(module).definitions:
            raise AttributeError(f"{module} defines no {name!r}")
        places: set[Place] = set()
        pending = [Place(module, name)]
        while pending:
            place = pending.pop()
            if place not in places:
                places.add(place)
                pending.extend(self._linked(place)[0])
        return places

    def places(self, module: str) -> list[Place]:
        """Return all definitions of a module."""
        return [Place(module, name) for name in self._source(module).definitions]

    def definition(self, place: Place) -> Definition:
        """Return the definition at a place."""
        return self._source(place.module).definitions[place.name]

    def _linked(self, place: Place) -> tuple[tuple[Place, ...], bytes]:
        """Return the places that a definition leads to, and a digest of what it says itself."""
        if place not in self._links:
            passed = {place.module: None}
            resolved = [self._resolved(chain, passed) for chain in self._chains(place)]
            targets = [target for target, _ in resolved if target]
            effects = [Place(module, EFFECTS) for module in self._imported(passed)]
            rests = "\n".join(f"{'#' if target else ''}{'.'.join(rest)}" for target, rest in resolved)
            text = hashlib.sha256(self.definition(place).digest + rests.encode()).digest()
            self._links[place] = ((*targets, *effects), text)
        return self._links[place]

    def _chains(self, place: Place) -> tuple[Chain, ...]:
        """Return what a definition names, with all that its module may import at run time."""
        source = self._source(place.module)
        definition = self.definition(place)
        chains = definition.chains + tuple((text,) for text in definition.strings if self._has(text))
        if source.dynamic and place.name != WHOLE:
            chains += ((place.module,),)
        if source.dynamic and place.name == WHOLE:
            chains += tuple((name,) for name in self._modules_below(place.module))
        return chains

    def _resolved(self, chain: Chain, passed: dict[str, None]) -> tuple[Place | None, Chain]:
        """Return where a chain leads and the attributes that are left; note the modules that it passes."""
        seen: set[Chain] = set()
        while chain not in seen:
            seen.add(chain)
            module, rest = chain[0], chain[1:]
            if module.split(".", maxsplit=1)[0] not in self.folders:
                return None, chain
            passed[module] = None
            source = self._source(module)
            if rest and rest[0] in source.definitions:
                return Place(module, rest[0]), rest[1:]
            if rest and rest[0] in source.imports:
                chain = (*source.imports[rest[0]], *rest[1:])
            elif rest and self._has(f"{module}.{rest[0]}"):
                chain = (f"{module}.{rest[0]}", *rest[1:])
            else:
                return Place(module, WHOLE), rest
        return Place(chain[0], WHOLE), chain[1:]

    def _imported(self, modules: dict[str, None]) -> list[str]:
        """Return modules and the packages around them that do something when they are imported."""
        parts = [module.split(".") for module in modules]
        each = (".".join(part[:length]) for part in parts for length in range(1, len(part) + 1))
        return [module for module in dict.fromkeys(each) if EFFECTS in self._source(module).definitions]

    def _modules_below(self, module: str) -> list[str]:
        file = self._path(module)
        below = file.parent.glob("*") if file.name == "__init__.py" else ()
        names = {f"{module}.{path.stem}" for path in below if path.stem != "__init__"}
        return sorted(name for name in names if self._has(name))

    def _source(self, module: str) -> Source:
        if module not in self._sources:
            self._sources[module] = read_source(module, self._path(module), frozenset(self.folders))
        return self._sources[module]

    def _has(self, module: str) -> bool:
        return self._file(module) is not None

    def _path(self, module: str) -> Path:
        path = self._file(module)
        if path is None:
            raise ModuleNotFoundError(f"there is no module {module!r}")
        return path

    def _file(self, module: str) -> Path | None:
        if module not in self._files:
            package, *below = module.split(".")
            base = self.folders[package].joinpath(*below)
            files = (path for path in (base / "__init__.py", base.with_suffix(".py")) if path.is_file())
            self._files[module] = next(files, None)
        return self._files[module]


@cache
def stage_hash(module: str, name: str = "run") -> str:
    """Return the hash of a stage's function, ``run`` of ``swesbi.study.stages.pool``, say.

    Raises:
        As ``Packages.hash``.
    """
    return _packages(module.partition(".")[0]).hash(module, name)


@cache
def _packages(name: str) -> Packages:
    """Return the sources of this package, and of another one that imports it."""
    own = Path(__file__).parents[2]
    if name == own.name:
        return Packages(own)
    spec = find_spec(name)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"no package is named {name!r}")
    return Packages(own, Path(spec.submodule_search_locations[0]))
