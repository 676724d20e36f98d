"""A program of JavaScript: the functions that are asked for, and all that they lead to."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from explorer.translation import syntax
from explorer.translation.calls import Signature
from explorer.translation.classes import class_lines, constructor_names, methods, protocol_lines
from explorer.translation.library import identifier, runtime
from explorer.translation.loops import loop_lines
from explorer.translation.modules import module, resolved, value_of
from explorer.translation.refusal import UntranslatableError, refused
from explorer.translation.statements import decorators, function_lines, parameters
from explorer.translation.values import literal

TYPES: Final = {"Protocol", "TypeAlias"}
ENUMS: Final = {"Enum", "IntEnum"}


@dataclass(frozen=True)
class Loop:
    """A compiled loop, the function that makes it, and the number of axes of the loop's arrays.

    Each variant, arguments of that function, makes a loop of its own.
    """

    factory: syntax.Chain
    variants: Sequence[tuple[object, ...]]
    ranks: Mapping[str, int]


@dataclass
class Program:
    """What is translated so far.

    Values in ``given`` are others here than in the package; functions in ``own`` are JavaScript's own, by
    their names there.
    """

    loops: Mapping[syntax.Chain, Loop] = field(default_factory=dict)
    given: Mapping[syntax.Chain, object] = field(default_factory=dict)
    own: Mapping[syntax.Chain, str] = field(default_factory=dict)
    _names: dict[syntax.Chain, str] = field(default_factory=dict)
    _parts: dict[str, list[str]] = field(default_factory=dict)
    _signatures: dict[str, set[Signature]] = field(default_factory=dict)

    # --- what the writers ask

    def reference(self, chain: syntax.Chain) -> str:
        """Return what a definition is called, and have it and what it leads to translated."""
        if chain in self.own:
            return self.own[chain]
        if chain in self._names:
            return self._names[chain]
        if chain in self.given:
            return literal(self.given[chain], self.of_value)
        kind = self.root(chain)
        if isinstance(kind, ast.ClassDef) and ENUMS & set(map(ast.unparse, kind.bases)):
            return literal(value_of(chain), self.of_value)
        if len(chain) > 2:
            return ".".join((self.reference(chain[:2]), *chain[2:]))
        return (
            self._named(chain) if isinstance(kind, ast.FunctionDef | ast.ClassDef) else self._constant(chain)
        )

    def root(self, chain: syntax.Chain) -> ast.stmt:
        """Return the statement that defines what a chain begins with."""
        home = module(chain[0])
        if len(chain) < 2:
            raise refused(home.path, ast.Pass(), f"the module {chain[0]} as a value")
        return home.definition(chain[1])

    def signature(self, chain: syntax.Chain) -> Signature | None:
        """Return the parameters of a function or class; None where it has none to be told."""
        if chain in self.own or not isinstance(self.root(chain), ast.FunctionDef | ast.ClassDef):
            return None
        node = self.root(chain)
        if len(chain) > 2:
            assert isinstance(node, ast.ClassDef)
            inner = next((part for part in methods(node) if part.name == chain[2]), None)
            return (
                None
                if inner is None
                else _names_of(inner, skipped=0 if "staticmethod" in decorators(inner) else 1)
            )
        if isinstance(node, ast.ClassDef):
            return constructor_names(node)
        assert isinstance(node, ast.FunctionDef)
        return _names_of(node, skipped=0)

    def is_class(self, chain: syntax.Chain) -> bool:
        """Tell whether a definition is a class."""
        return isinstance(self.root(chain), ast.ClassDef)

    def method_signatures(self, name: str) -> frozenset[Signature]:
        """Return the parameters of all methods of this name."""
        return frozenset(self._signatures.get(name, ()))

    # --- writing

    def know(self, *names: str) -> None:
        """Take the methods of classes of the package, by module and name, as known beforehand."""
        for dotted in names:
            home, name = dotted.rsplit(".", maxsplit=1)
            self._know(module(home).definition(name))

    def _know(self, node: ast.stmt) -> None:
        assert isinstance(node, ast.ClassDef)
        for part in [part for part in node.body if isinstance(part, ast.FunctionDef)]:
            if not decorators(part) & {"property"}:
                skipped = 0 if "staticmethod" in decorators(part) else 1
                self._signatures.setdefault(part.name, set()).add(_names_of(part, skipped))

    def _named(self, chain: syntax.Chain) -> str:
        name = identifier(chain[1])
        if name in self._parts:
            name = f"{chain[0].rsplit('.', maxsplit=1)[-1]}_{name}"
        self._names[chain] = name
        self._parts[name] = []  # the name is taken
        lines = self._lines(chain, name)
        del self._parts[name]
        self._parts[name] = lines  # behind what it leads to: a class is made after the one that it extends
        return name

    def _lines(self, chain: syntax.Chain, name: str) -> list[str]:
        home, node = module(chain[0]), module(chain[0]).definition(chain[1])
        if chain in self.loops:
            return self._loop(chain, name)
        if isinstance(node, ast.ClassDef):
            self._know(node)
            if TYPES & set(map(ast.unparse, node.bases)):
                return protocol_lines(node, home, name)
            return class_lines(node, home, self, name)
        assert isinstance(node, ast.FunctionDef)
        return function_lines(node, home, self, {}, name)

    def _loop(self, chain: syntax.Chain, name: str) -> list[str]:
        """Write a loop for each variant, and the function that chooses among them."""
        loop = self.loops[chain]
        home, factory = module(chain[0]), module(chain[0]).definition(chain[1])
        assert isinstance(factory, ast.FunctionDef)
        inner = next(part for part in factory.body if isinstance(part, ast.FunctionDef))
        names = [part.arg for part in parameters(factory)]
        lines, cases = [], []
        for number, variant in enumerate(loop.variants):
            constants = {"key": 0} | dict(zip(names, variant, strict=True))
            constants |= {target: constants[source] for target, source in _aliases(factory)}
            lines += loop_lines(home, inner, f"{name}{number}", loop.ranks, constants, self.given)
            cases.append(f"[{', '.join(literal(value, self.of_value) for value in variant)}]")
        chosen = ", ".join(f"{name}{number}" for number in range(len(cases)))
        return [
            *lines,
            f"function {name}(...given) {{ return chosenLoop({name}, given); }}",
            f"{name}.loops = [{chosen}];",
            f"later(() => {{ {name}.variants = [{', '.join(cases)}]; }});",
        ]

    def _constant(self, chain: syntax.Chain) -> str:
        value = self._plain(chain)
        try:
            text = literal(value, self.of_value)
        except UntranslatableError as error:
            raise refused(module(chain[0]).path, self.root(chain), f"{'.'.join(chain)} ({error})") from error
        if isinstance(value, int | float):
            return text
        name = identifier(chain[1])
        if name in self._parts:
            name = f"{chain[0].rsplit('.', maxsplit=1)[-1]}_{name}"
        self._names[chain] = name
        self._parts[name] = [f"let {name};", f"later(() => {{ {name} = {text}; }});"]
        return name

    def _plain(self, chain: syntax.Chain) -> object:
        """Return a constant; one that is written out is read, so that its module need not be imported."""
        written = getattr(self.root(chain), "value", None)
        return written.value if isinstance(written, ast.Constant) else value_of(chain)

    def of_value(self, module_name: str, qualified: str) -> str:
        """Return what the class or function of a value is called."""
        return self.reference(resolved((module_name, *qualified.split("."))))

    def text(self) -> str:
        """Return the program: the runtime, then every definition; constants are made last."""
        parts = ["\n".join(lines) for lines in self._parts.values()]
        return "\n\n".join([runtime(), LATER, *parts, "for (const make of delayed) make();"]) + "\n"


LATER: Final = """const delayed = [];
function later(make) { delayed.push(make); }
function chosenLoop(made, given) {
  const wanted = JSON.stringify([...given, ...made.variants[0].slice(given.length)]);
  const place = made.variants.findIndex((variant) => JSON.stringify(variant) === wanted);
  if (place < 0) throw new Error(`this page has no loop for ${wanted}`);
  return made.loops[place];
}"""


def _names_of(node: ast.FunctionDef, skipped: int) -> Signature:
    return tuple(part.arg for part in parameters(node)[skipped:])


def _aliases(factory: ast.FunctionDef) -> list[tuple[str, str]]:
    """Return what the factory of a loop gives another name: ``o = options``."""
    return [
        (part.targets[0].id, part.value.id)
        for part in factory.body
        if isinstance(part, ast.Assign)
        and isinstance(part.targets[0], ast.Name)
        and isinstance(part.value, ast.Name)
    ]
