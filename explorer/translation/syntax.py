"""What statements of Python bind and import, and what the names of a module stand for."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final, TypeAlias

Chain: TypeAlias = tuple[str, ...]
"""What a name stands for: module, name, attributes."""
DYNAMIC: Final = {"importlib.import_module", "pkgutil", "runpy", "__import__"}
REFUSED_METHODS: Final = {"__init_subclass__", "__subclasses__"}
REFUSED: Final = {"eval", "exec", "globals", "locals", *REFUSED_METHODS}
DEFINITIONS: Final = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
BLOCKS: Final = ("body", "orelse", "finalbody", "handlers", "cases")


class Names:
    """What the names of one module stand for: those bound by imports, and those bound otherwise.

    Definitions of ``packages`` are followed. A ``dynamic`` module imports modules by names made when it runs.
    """

    def __init__(self, name: str, path: Path, packages: frozenset[str]) -> None:
        self.name, self.path, self.packages = name, path, packages
        self.imports: dict[str, Chain] = {}
        self.bound: dict[str, list[ast.stmt]] = {}
        self.dynamic = False

    def chain_of(self, name: str) -> Chain | None:
        """Return what a name of the module stands for, None where it binds no such name."""
        return (self.name, name) if name in self.bound else self.imports.get(name)

    def targets(self, statement: ast.Import | ast.ImportFrom) -> dict[str, Chain]:
        """Return what each name that an import statement binds stands for.

        A star import from one of the packages is refused.
        """
        if isinstance(statement, ast.Import):
            return {
                alias.asname or alias.name.split(".")[0]: (
                    (alias.name,) if alias.asname else (alias.name.split(".")[0],)
                )
                for alias in statement.names
            }
        module = self._absolute(statement)
        if self.is_own((module,)) and any(alias.name == "*" for alias in statement.names):
            raise ValueError(
                f"{self.path}:{statement.lineno}: a star import cannot be followed; name what is used"
            )
        return {alias.asname or alias.name: (module, alias.name) for alias in statement.names}

    def is_own(self, chain: Chain) -> bool:
        """Tell whether a chain begins in one of the packages."""
        return chain[0].split(".", maxsplit=1)[0] in self.packages

    def note(self, name: str, line: int) -> None:
        """Note what is no name of a package: it may import modules that the text does not name.

        What changes definitions, or runs code, in ways that the text does not show is refused.
        """
        self.dynamic |= name in DYNAMIC
        if name in REFUSED:
            raise ValueError(f"{self.path}:{line}: what {name} does cannot be followed; name what is used")

    def _absolute(self, statement: ast.ImportFrom) -> str:
        parts = self.name.split(".")
        if self.path.name == "__init__.py":
            parts = [*parts, ""]
        base = parts[: len(parts) - statement.level] if statement.level else []
        return ".".join([*base, *([statement.module] if statement.module else [])])

    def brought_in(self, statement: ast.Import | ast.ImportFrom) -> dict[str, Chain]:
        """Return what an import brings in from the packages, by the name that it binds."""
        targets = self.targets(statement)
        if isinstance(statement, ast.Import):
            targets = {f"{alias.name} as a module": (alias.name,) for alias in statement.names}
        return {name: chain for name, chain in targets.items() if self.is_own(chain)}


def lines_of(statement: ast.stmt) -> tuple[int, int]:
    """Return the first and last line of a statement, its decorators included."""
    decorators = getattr(statement, "decorator_list", [])
    first = min(part.lineno for part in (statement, *decorators))
    return first, statement.end_lineno or first


def nested(statements: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield statements and those in their blocks, not those of functions and classes among them."""
    for statement in statements:
        yield statement
        if not isinstance(statement, DEFINITIONS):
            for block in BLOCKS:
                yield from nested(getattr(statement, block, ()))


def imports_of(statements: Iterable[ast.stmt]) -> Iterator[ast.Import | ast.ImportFrom]:
    """Return the imports among statements and in their blocks."""
    return (part for part in nested(statements) if isinstance(part, ast.Import | ast.ImportFrom))


def bound_by(statements: Iterable[ast.stmt]) -> Iterator[str]:
    """Yield the names that statements bind, beside imports."""
    for part in nested(statements):
        if isinstance(part, DEFINITIONS):
            yield part.name
        elif isinstance(part, ast.Assign):
            yield from (name for target in part.targets for name in stored_names(target))
        elif isinstance(part, ast.AnnAssign | ast.AugAssign | ast.For | ast.AsyncFor):
            yield from stored_names(part.target)
        elif isinstance(part, ast.With | ast.AsyncWith):
            targets = (item.optional_vars for item in part.items if item.optional_vars)
            yield from (name for target in targets for name in stored_names(target))


def stored_names(target: ast.expr) -> Iterator[str]:
    """Return the names that the target of an assignment binds."""
    nodes = [target] if isinstance(target, ast.Name) else ast.walk(target)
    return (node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))


def parameter_names(given: ast.arguments) -> Iterator[str]:
    """Return the names of a function's parameters."""
    each = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    return (parameter.arg for parameter in each if parameter)


def alters(statement: ast.stmt) -> bool:
    """Tell whether an assignment changes an object: its attribute or one of its entries."""
    targets = getattr(statement, "targets", [getattr(statement, "target", None)])
    nodes = (node for target in targets if target for node in ast.walk(target))
    return any(isinstance(node, ast.Attribute | ast.Subscript) for node in nodes)


def constants_of(statements: Iterable[ast.stmt]) -> set[str]:
    """Return the constants in statements, as text."""
    nodes = (node for statement in statements for node in ast.walk(statement))
    return {str(node.value) for node in nodes if isinstance(node, ast.Constant)}


def is_typing(test: ast.expr) -> bool:
    """Tell whether a condition holds for type checkers alone."""
    return isinstance(test, ast.Name | ast.Attribute) and ast.unparse(test).endswith("TYPE_CHECKING")


def is_main(statement: ast.stmt) -> bool:
    """Tell whether a statement runs only where its module is the program."""
    return isinstance(statement, ast.If) and ast.unparse(statement.test) == "__name__ == '__main__'"


def is_text(statement: object) -> bool:
    """Tell whether a statement is a text alone: a docstring."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )
