"""The definitions of one module as the hash of the code sees them: their meaning as text, and what they name.

The text of a definition has no docstrings, comments or positions, and no descriptions of the fields of
settings, which say what a value means and change none. A name that the module imports or defines
is written as a number, and the chain that it stands for is kept beside it: module, name, attributes, as
``("swesbi.seeds", "generator")``. How a name was imported, and from where, so is not part of the text.
"""

from __future__ import annotations

import ast
import contextlib
import gc
import hashlib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Final, TypeAlias

from swesbi.study.code import syntax

Scope: TypeAlias = Mapping[str, "syntax.Chain | None"]

EFFECTS: Final = ""
"""Stands for the name of all that a module does when it is imported, beside binding names."""
WHOLE: Final = "*"
"""Stands for the name of a whole module: all that it binds and does."""
DATA_FILE: Final = re.compile(r"\w[\w/-]*\.(?!py\b)\w[\w.]*")
_FUNCTIONS: Final = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
_COMPREHENSIONS: Final = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_ANNOTATED: Final = {"annotation", "returns"}
_SKIPPED: Final = {"ctx", "type_comment", "kind"}
_FIELD: Final = ("pydantic", "Field")
_DESCRIPTION: Final = "description"


@dataclass(frozen=True)
class Definition:
    """What one name of a module stands for.

    Attributes:
        digest: Of the text, and of the data files that it names.
        chains: What it names, in the order in which the text counts them.
        strings: What it has in strings that may be names of modules.
        lines: First and last line of its statements in the file.
    """

    digest: bytes
    chains: tuple[syntax.Chain, ...]
    strings: tuple[str, ...] = ()
    lines: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Source:
    """One module of a package.

    Attributes:
        definitions: By name, those under ``EFFECTS`` and ``WHOLE`` included.
        imports: Names that the module binds by an import, and what they stand for.
        dynamic: Whether it imports modules by names that are made when it runs.
    """

    definitions: Mapping[str, Definition]
    imports: Mapping[str, syntax.Chain]
    dynamic: bool


def read_source(name: str, path: Path, packages: frozenset[str]) -> Source:
    """Read the module ``name`` of one of ``packages``.

    Raises:
        ValueError: It has what cannot be followed: a star import, ``exec`` and the like.
        SyntaxError: It is no Python.
    """
    with _collector_waiting():
        reader = _Reader(name, path, packages)
        reader.read(ast.parse(path.read_text(encoding="utf-8"), str(path)).body)
        return Source(reader.written(), reader.imports, reader.dynamic)


@contextlib.contextmanager
def _collector_waiting() -> Iterator[None]:
    """Keep the collector from looking for cycles in syntax trees, which have none: half of the time."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


class _Reader(syntax.Names):
    """Sorts the statements of one module."""

    def __init__(self, name: str, path: Path, packages: frozenset[str]) -> None:
        super().__init__(name, path, packages)
        self._effects: list[ast.stmt] = []
        self._at_runtime: dict[str, syntax.Chain] = {}

    def read(self, statements: Iterable[ast.stmt], at_runtime: bool = True) -> None:
        """Sort top-level statements: imports, what binds a name, what has an effect."""
        for statement in statements:
            if isinstance(statement, ast.Import | ast.ImportFrom):
                targets = self.targets(statement)
                for name, chain in targets.items():
                    if self.imports.setdefault(name, chain) != chain:
                        raise self._ambiguous(name)
                self._at_runtime |= self.brought_in(statement) if at_runtime else {}
            elif isinstance(statement, ast.If) and syntax.is_typing(statement.test):
                self.read(statement.body, at_runtime=False)
                self.read(statement.orelse)
            elif not (syntax.is_text(statement) or syntax.is_main(statement)):
                self._bind(statement)

    def _bind(self, statement: ast.stmt) -> None:
        names = list(syntax.bound_by([statement]))
        for name in names:
            self.bound.setdefault(name, []).append(statement)
        plain = isinstance(statement, (*syntax.DEFINITIONS, ast.Assign, ast.AnnAssign, ast.AugAssign))
        if not plain or syntax.alters(statement):
            self._effects.append(statement)

    def written(self) -> dict[str, Definition]:
        for name in self.bound.keys() & self.imports.keys():
            raise self._ambiguous(name)
        written = {name: self._write(statements) for name, statements in self.bound.items()}
        effects = self._write(self._effects)
        mentioned = {chain for definition in (*written.values(), effects) for chain in definition.chains}
        chains = [*effects.chains, *self._registered(), *self._imported_for_effect(mentioned)]
        if chains or self._effects:
            written[EFFECTS] = replace(effects, chains=tuple(chains))
        everything: list[syntax.Chain] = [(self.name, name) for name in sorted(self.bound)]
        everything += [self.imports[name] for name in sorted(self.imports) if self.is_own(self.imports[name])]
        written[WHOLE] = Definition(b"", tuple(everything))
        return written

    def _ambiguous(self, name: str) -> ValueError:
        return ValueError(f"{self.path}: {name} stands for two things; give one of them another name")

    def _registered(self) -> Iterator[syntax.Chain]:
        """Yield the definitions with a decorator of the package, which may note them somewhere."""
        for name, statements in self.bound.items():
            for statement in statements:
                if isinstance(statement, syntax.DEFINITIONS) and any(
                    map(self._is_own_name, statement.decorator_list)
                ):
                    yield self.name, name

    def _is_own_name(self, node: ast.expr) -> bool:
        while isinstance(node, ast.Call | ast.Attribute):
            node = node.func if isinstance(node, ast.Call) else node.value
        chain = self.chain_of(node.id) if isinstance(node, ast.Name) else None
        return chain is not None and self.is_own(chain)

    def _imported_for_effect(self, mentioned: set[syntax.Chain]) -> Iterator[syntax.Chain]:
        """Yield the modules whose import is all that is wanted: nothing here names what it binds."""
        exported = syntax.constants_of(self.bound.get("__all__", []))
        for name, chain in self._at_runtime.items():
            used = any(_begins(other, chain) for other in mentioned)
            if not (used or name in exported or self._is_reexport(chain)):
                yield from (chain, chain[:1])

    def _is_reexport(self, chain: syntax.Chain) -> bool:
        """Tell whether an import of ``__init__`` hands on a definition; one of a module may be for effect."""
        folder = self.path.parent
        if self.path.name != "__init__.py" or len(chain) == 1:
            return False
        below = [folder / f"{chain[1]}.py", folder / chain[1] / "__init__.py"]
        return chain[0] != self.name or not any(path.is_file() for path in below)

    def _write(self, statements: Sequence[ast.stmt]) -> Definition:
        writer = _Writer(self)
        writer.write(list(statements), {})
        digest = hashlib.sha256("\0".join(writer.text).encode())
        for path in sorted(self.path.parent / text for text in writer.strings if DATA_FILE.fullmatch(text)):
            if path.is_file():
                digest.update(path.name.encode() + b"\n" + path.read_bytes())
        modules = tuple(sorted(filter(self._is_dotted, writer.strings)))
        return Definition(
            digest.digest(), tuple(writer.chains), modules, tuple(map(syntax.lines_of, statements))
        )

    def _is_dotted(self, text: str) -> bool:
        return "." in text and self.is_own((text,)) and all(map(str.isidentifier, text.split(".")))


class _Writer:
    """Writes the meaning of statements, and gathers what they name."""

    def __init__(self, source: syntax.Names) -> None:
        self.source = source
        self.text: list[str] = []
        self.chains: dict[syntax.Chain, int] = {}
        self.strings: set[str] = set()

    def write(self, node: object, scope: Scope) -> None:
        """Write a node of the syntax tree; ``scope`` has the names of the functions around it.

        There, None stands for a local variable, and a chain for what a function imports.
        """
        if isinstance(node, list):
            self.text.append("[")
            for part in node:
                if not syntax.is_text(part):
                    self.write(part, scope)
            self.text.append("]")
        elif not isinstance(node, ast.AST):
            self.text.append(repr(node))
        else:
            self._HANDLERS.get(type(node), _Writer._fields)(self, node, scope)

    def _fields(self, node: ast.AST, scope: Scope, without: str = "") -> None:
        self.text.append(type(node).__name__)
        for field in node._fields:
            value = getattr(node, field, None)
            # what a newer Python adds to the syntax tree is empty where it is not used
            if value is None or value == [] or field in _SKIPPED or field == without:
                continue
            self.text.append(field)
            if field in _ANNOTATED:
                self._annotation(value, scope)
            self.write(value, scope)
        self.text.append(")")

    def _constant(self, node: ast.Constant, scope: Scope) -> None:
        self.text.append(repr(node.value))
        if isinstance(node.value, str):
            self.strings.add(node.value)

    def _call(self, node: ast.Call, scope: Scope) -> None:
        """Write a call: in ``cast``, an annotation comes first; a field's description is left out."""
        if isinstance(node.func, ast.Name) and node.func.id == "cast" and node.args:
            self._annotation(node.args[0], scope)
        if self._is_field(node.func, scope):
            keywords = [given for given in node.keywords if given.arg != _DESCRIPTION]
            node = ast.Call(node.func, node.args, keywords)
        self._fields(node, scope)

    def _is_field(self, function: ast.expr, scope: Scope) -> bool:
        if not isinstance(function, ast.Name) or function.id in scope:
            return False
        return self.source.chain_of(function.id) == _FIELD

    def _annotation(self, annotation: ast.AST, scope: Scope) -> None:
        """Follow the names in the strings of an annotation."""
        for node in ast.walk(annotation):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                try:
                    named = ast.parse(node.value, mode="eval").body
                except SyntaxError:  # a value of Literal, say
                    continue
                self.write(named, scope)

    def _reference(self, node: ast.Name | ast.Attribute, scope: Scope) -> None:
        """Write a name with its attributes, by number if it stands for something that is not local."""
        attributes: list[str] = []
        base: ast.expr = node
        while isinstance(base, ast.Attribute):
            attributes.insert(0, base.attr)
            if base.attr in syntax.REFUSED_METHODS:
                self.source.note(base.attr, base.lineno)
            base = base.value
        if not isinstance(base, ast.Name):
            self._fields(node, scope)
            return
        chain = scope[base.id] if base.id in scope else self.source.chain_of(base.id)
        if chain is None:
            self.source.note(base.id, base.lineno)
            self.text.append(".".join((base.id, *attributes)))
        elif isinstance(node.ctx, ast.Load) or attributes:
            self._mention((*chain, *attributes))
        else:  # the name that a constant binds
            self.text.append(base.id)

    def _mention(self, chain: syntax.Chain) -> None:
        if self.source.is_own(chain):
            self.text.append(f"#{self.chains.setdefault(chain, len(self.chains))}")
        else:
            self.text.append(".".join(chain))
            self.source.dynamic |= chain[0] in syntax.DYNAMIC or ".".join(chain[:2]) in syntax.DYNAMIC

    def _function(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda, scope: Scope) -> None:
        """Write decorators, defaults and annotations in the scope around, the body in the function's own."""
        self._fields(node, scope, without="body")
        name = getattr(node, "name", "")
        if name in syntax.REFUSED_METHODS:
            self.source.note(name, node.lineno)
        body: list[ast.stmt] = [] if isinstance(node, ast.Lambda) else node.body
        bound = {*syntax.bound_by(body), *syntax.parameter_names(node.args)}
        imported: dict[str, syntax.Chain] = {}
        for statement in syntax.imports_of(body):
            for bound_name, chain in self.source.targets(statement).items():
                if imported.setdefault(bound_name, chain) != chain:  # under another condition
                    self._mention(chain)
        shared = {name for part in syntax.nested(body) if isinstance(part, ast.Global) for name in part.names}
        inner = {**scope, **dict.fromkeys(bound), **imported}
        self.write(node.body, {name: chain for name, chain in inner.items() if name not in shared})
        for statement in syntax.imports_of(body):
            for chain in self.source.brought_in(statement).values():
                if not any(_begins(other, chain) for other in self.chains):
                    self._mention(chain)

    def _comprehension(
        self, node: ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp, scope: Scope
    ) -> None:
        """Write the first sequence in the scope around, all else with the comprehension's variables."""
        self.write(node.generators[0].iter, scope)
        targets = [name for part in node.generators for name in syntax.stored_names(part.target)]
        self._fields(node, {**scope, **dict.fromkeys(targets)})

    def _global(self, node: ast.Global, scope: Scope) -> None:
        self.write([ast.Name(name, ast.Load(), lineno=node.lineno) for name in node.names], scope)

    def _import(self, node: ast.Import | ast.ImportFrom, scope: Scope) -> None:
        """Follow an import of a class or under a condition; a function's own are in its scope."""
        for name, chain in self.source.targets(node).items():
            if scope.get(name) != chain:
                for brought in (chain, *self.source.brought_in(node).values()):
                    self._mention(brought)

    _HANDLERS: ClassVar[Mapping[type[ast.AST], Callable[..., None]]] = {
        ast.Constant: _constant,
        ast.Name: _reference,
        ast.Attribute: _reference,
        ast.Call: _call,
        ast.Global: _global,
        **dict.fromkeys(_FUNCTIONS, _function),
        **dict.fromkeys(_COMPREHENSIONS, _comprehension),
        **dict.fromkeys((ast.Import, ast.ImportFrom), _import),
    }


def _begins(chain: syntax.Chain, with_chain: syntax.Chain) -> bool:
    return ".".join((*chain, "")).startswith(".".join((*with_chain, "")))
