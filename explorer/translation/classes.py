"""Classes in JavaScript: dataclasses, named tuples, settings, protocols, and plain ones with ``__init__``."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Final

from explorer.translation import modules, syntax
from explorer.translation.calls import INDENT, Program
from explorer.translation.library import identifier
from explorer.translation.modules import Module, resolved
from explorer.translation.refusal import refused
from explorer.translation.statements import (
    VALIDATORS,
    Statements,
    decorators,
    defaults,
    method_lines,
    parameters,
)
from swesbi.artefacts import Artefact

ERRORS: Final = {"ValueError": "ValueError", "Exception": "PythonError"}
ARTEFACT: Final = Artefact.__name__
OF_FILES: Final = frozenset(vars(Artefact))
"""What makes a class a file, which the page has none of."""
ABSTRACT: Final = "raise NotImplementedError"


def methods(node: ast.ClassDef) -> list[ast.FunctionDef]:
    """Return the methods of a class that are translated: no checks, nothing abstract, no files."""
    return [
        part
        for part in node.body
        if isinstance(part, ast.FunctionDef)
        and not decorators(part) & VALIDATORS
        and not (part.name in OF_FILES and ARTEFACT in map(ast.unparse, node.bases))
        and not all(syntax.is_text(line) or ast.unparse(line) == ABSTRACT for line in part.body)
    ]


def fields(node: ast.ClassDef) -> list[ast.AnnAssign]:
    """Return the fields of a dataclass, a named tuple or settings."""
    return [
        part
        for part in node.body
        if isinstance(part, ast.AnnAssign)
        and isinstance(part.target, ast.Name)
        and "ClassVar" not in ast.unparse(part.annotation)
        and "init=False" not in ast.unparse(part)
    ]


def constructor_names(node: ast.ClassDef) -> tuple[str, ...]:
    """Return what an instance is made of, in order."""
    for part in methods(node):
        if part.name == "__init__":
            given = tuple(argument.arg for argument in parameters(part)[1:])
            return (*given, part.args.vararg.arg) if part.args.vararg else given
    return tuple(part.target.id for part in fields(node) if isinstance(part.target, ast.Name))


def class_lines(node: ast.ClassDef, module: Module, program: Program, name: str) -> list[str]:
    """Return the lines of a class."""
    writer = Statements(module, {}, program)
    base = _base(node, module, program)
    lines = [*_constructor(node, writer, base, module, program)]
    for part in methods(node):
        if part.name != "__init__":
            lines += method_lines(part, module, program)
    names = constructor_names(node)
    if base not in ERRORS.values():
        lines.append(f"*[Symbol.iterator]() {{ yield* [{', '.join(f'this.{one}' for one in names)}]; }}")
    listed = ", ".join(f'"{one}"' for one in names)
    return [
        f"class {name}{f' extends {base}' if base else ''} {{",
        *(f"{INDENT}{line}" for line in lines),
        "}",
        f"{name}.isClass = true;",
        f"{name}.parameters = [{listed}];",
    ]


def protocol_lines(node: ast.ClassDef, module: Module, name: str) -> list[str]:
    """Return the lines of a protocol: what has all of its members is an instance."""
    listed = ", ".join(f'"{one}"' for one in _members(node, module))
    test = f"static [Symbol.hasInstance](value) {{ return [{listed}].every((name) => name in value); }}"
    return [f"class {name} {{", f"{INDENT}{test}", "}"]


def _members(node: ast.ClassDef, module: Module) -> Iterator[str]:
    """Yield the names of the members of a protocol, those of the protocols that it extends among them."""
    yield from (part.name for part in node.body if isinstance(part, ast.FunctionDef))
    for chain in (module.chain_of(ast.unparse(part)) for part in node.bases):
        if chain is not None and module.is_own(chain):
            home, name = resolved(chain)
            base = modules.module(home)
            definition = base.definition(name)
            assert isinstance(definition, ast.ClassDef)
            yield from _members(definition, base)


def _base(node: ast.ClassDef, module: Module, program: Program) -> str:
    """Return what a class extends: an error, or a generic class of the package, which has no fields."""
    for part in node.bases:
        if ast.unparse(part) in ERRORS:
            return ERRORS[ast.unparse(part)]
        chain = module.chain_of(ast.unparse(part.value)) if isinstance(part, ast.Subscript) else None
        if chain is not None and module.is_own(chain):
            if program.signature(resolved(chain)):
                raise refused(module.path, part, f"{ast.unparse(part)}, a base with fields,")
            return program.reference(resolved(chain))
    return ""


def _constructor(
    node: ast.ClassDef, writer: Statements, base: str, module: Module, program: Program
) -> list[str]:
    own = next((part for part in methods(node) if part.name == "__init__"), None)
    begun = [f"{INDENT}super();"] if base else []
    if own is not None:
        _, *body = method_lines(own, module, program)
        given = [*parameters(own)[1:], *([own.args.vararg] if own.args.vararg else [])]
        known = defaults(own)
        head = ", ".join(
            ("..." if part is own.args.vararg else "")
            + identifier(part.arg)
            + (f" = {writer.write(known[part.arg])}" if part.arg in known else "")
            for part in given
        )
        return [f"constructor({head}) {{", *begun, *body]
    names = constructor_names(node)
    if base and not names:
        return []
    head = ", ".join(_field(part, writer) for part in fields(node))
    body = [*begun, *(f"{INDENT}this.{one} = {identifier(one)};" for one in names)]
    if any(part.name == "__post_init__" for part in methods(node)):
        body.append(f"{INDENT}this.postInit_();")
    return [f"constructor({head}) {{", *body, "}"]


def _field(part: ast.AnnAssign, writer: Statements) -> str:
    assert isinstance(part.target, ast.Name)
    name = identifier(part.target.id)
    value = part.value
    if isinstance(value, ast.Call) and ast.unparse(value.func) in {"Field", "field"}:
        given = {keyword.arg: keyword.value for keyword in value.keywords}
        if "default_factory" in given:
            return f"{name} = {writer.write(given['default_factory'])}()"
        value = given.get("default")
    return name if value is None else f"{name} = {writer.write(value)}"
