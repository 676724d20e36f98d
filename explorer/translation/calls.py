"""Names, operators and calls: operators become calls that also take arrays, names what they stand for."""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping
from typing import Final, Protocol

from explorer.translation import library, syntax
from explorer.translation.modules import Module, resolved
from explorer.translation.refusal import UntranslatableError, refused
from explorer.translation.values import number

INDENT: Final = "  "
Signature = tuple[str, ...]
"""Names of the parameters in order, ``self`` and ``cls`` left out."""


class Program(Protocol):
    """What is asked about the rest of what is translated."""

    def reference(self, chain: syntax.Chain) -> str:
        """Return what a definition of the package is called, and have it translated."""

    def signature(self, chain: syntax.Chain) -> Signature | None:
        """Return the parameters of a function or class of the package; None of what cannot be called."""

    def is_class(self, chain: syntax.Chain) -> bool:
        """Tell whether a definition is a class."""

    def method_signatures(self, name: str) -> frozenset[Signature]:
        """Return the parameters of all methods of this name."""


class Calls:
    """Writes names, operators and calls of one function.

    The scope has what the names of the function and those around it import, None for variables.
    """

    def __init__(self, module: Module, scope: Mapping[str, syntax.Chain | None], program: Program) -> None:
        self.module, self.scope, self.program = module, dict(scope), program

    def write(self, node: ast.expr) -> str:
        """Return an expression in JavaScript; an UntranslatableError says where it has what is not known."""
        raise NotImplementedError

    def refuse(self, node: ast.AST, what: str) -> UntranslatableError:
        """Return the refusal of a node."""
        return refused(self.module.path, node, what)

    def list_of(self, nodes: list[ast.expr]) -> str:
        """Return expressions with commas between them."""
        return ", ".join(map(self.write, nodes))

    def test(self, node: ast.expr) -> str:
        """Return a condition, whose truth is JavaScript's."""
        if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.Is | ast.IsNot | ast.In | ast.NotIn):
            return self.write(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return self.write(node)
        return f"py.truth({self.write(node)})"

    # --- names

    def chain(self, node: ast.expr) -> syntax.Chain | None:
        """Return what a dotted name stands for; None where it begins with a variable, or is no such name."""
        attributes: list[str] = []
        while isinstance(node, ast.Attribute):
            attributes.insert(0, node.attr)
            node = node.value
        if not isinstance(node, ast.Name):
            return None
        root = self.scope[node.id] if node.id in self.scope else self.module.chain_of(node.id)
        return None if root is None else resolved((*root, *attributes))

    def _name(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Name | ast.Attribute)
        chain = self.chain(node)
        if chain is not None:
            return self._known(node, chain)
        if isinstance(node, ast.Attribute):
            return f"{self.write(node.value)}.{node.attr}"
        if node.id in self.scope:
            return library.identifier(node.id)
        if node.id in library.BUILTINS:
            return library.BUILTINS[node.id]
        raise self.refuse(node, f"the name {node.id}")

    def _known(self, node: ast.expr, chain: syntax.Chain) -> str:
        if chain[0].split(".")[0] in self.module.packages:
            return self.program.reference(chain)
        name = ".".join(chain)
        if name not in library.LIBRARY:
            raise self.refuse(node, name)
        return library.LIBRARY[name]

    # --- operators

    def _constant(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Constant)
        value = node.value
        if value is None or isinstance(value, bool):
            return {None: "null", True: "true", False: "false"}[value]
        if value is ...:
            return "ELLIPSIS"
        if isinstance(value, str):
            return json.dumps(value)
        if isinstance(value, int | float):
            return number(value)
        raise self.refuse(node, repr(value))

    def _binary(self, node: ast.expr) -> str:
        assert isinstance(node, ast.BinOp)
        return f"py.{self.operator(node.op, node)}({self.write(node.left)}, {self.write(node.right)})"

    def operator(self, op: ast.operator, node: ast.AST) -> str:
        """Return the function of the runtime for an operator."""
        name = type(op).__name__
        if name not in library.OPERATORS:
            raise self.refuse(node, f"the operator {name}")
        return library.OPERATORS[name]

    def _unary(self, node: ast.expr) -> str:
        assert isinstance(node, ast.UnaryOp)
        if isinstance(node.op, ast.Not):
            return (
                f"!{self.test(node.operand)}"
                if self.test(node.operand).startswith("py.")
                else f"!({self.test(node.operand)})"
            )
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return f"-{self.write(node.operand)}"
        name = {ast.USub: "neg", ast.Invert: "invert"}.get(type(node.op))
        if name is None:
            raise self.refuse(node, type(node.op).__name__)
        return f"py.{name}({self.write(node.operand)})"

    def _boolean(self, node: ast.expr) -> str:
        """``a or b`` is the first that holds, or the last."""
        assert isinstance(node, ast.BoolOp)
        *before, last = node.values
        text = self.write(last)
        for value in reversed(before):
            first, other = ("t", text) if isinstance(node.op, ast.Or) else (text, "t")
            text = f"((t) => (py.truth(t) ? {first} : {other}))({self.write(value)})"
        return text

    def _compare(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Compare)
        lefts = [node.left, *node.comparators[:-1]]
        parts = [
            self._comparison(node, left, op, right)
            for left, op, right in zip(lefts, node.ops, node.comparators, strict=True)
        ]
        if len(parts) > 2 or (len(parts) == 2 and not self._is_simple(node.comparators[0])):
            raise self.refuse(node, "this chain of comparisons")
        return parts[0] if len(parts) == 1 else f"(py.truth({parts[0]}) && {parts[1]})"

    @staticmethod
    def _is_simple(node: ast.expr) -> bool:
        return isinstance(node, ast.Name | ast.Constant | ast.Attribute)

    def _comparison(self, node: ast.AST, left: ast.expr, op: ast.cmpop, right: ast.expr) -> str:
        a, b = self.write(left), self.write(right)
        if isinstance(op, ast.Is | ast.IsNot):
            return f"({a} {'===' if isinstance(op, ast.Is) else '!=='} {b})"
        if isinstance(op, ast.In | ast.NotIn):
            return f"{'' if isinstance(op, ast.In) else '!'}py.contains({b}, {a})"
        return f"py.{library.COMPARISONS[type(op).__name__]}({a}, {b})"

    def _choice(self, node: ast.expr) -> str:
        assert isinstance(node, ast.IfExp)
        return f"({self.test(node.test)} ? {self.write(node.body)} : {self.write(node.orelse)})"

    def _walrus(self, node: ast.expr) -> str:
        assert isinstance(node, ast.NamedExpr)
        return f"({library.identifier(node.target.id)} = {self.write(node.value)})"

    # --- calls

    def _call(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Call)
        chain = self.chain(node.func)
        own = chain is not None and chain[0].split(".")[0] in self.module.packages
        if isinstance(node.func, ast.Attribute) and (chain is None or (own and self._is_of_value(chain))):
            return self._method_call(node, node.func)
        if chain is not None and own:
            return self._own_call(node, chain)
        if isinstance(node.func, ast.Name) and node.func.id in self.scope and chain is None:
            return self._unknown_call(node, self.write(node.func))
        if any(keyword.arg is None for keyword in node.keywords):
            return self._unknown_call(node, self.write(node.func))
        return f"{self.write(node.func)}({self._given(node)})"

    def _is_of_value(self, chain: syntax.Chain) -> bool:
        """Tell whether a chain is an attribute of a constant of a module."""
        return len(chain) > 2 and not self.program.is_class(chain)

    def _own_call(self, node: ast.Call, chain: syntax.Chain) -> str:
        name = self.program.reference(chain)
        names = self.program.signature(chain)
        if names is None or any(keyword.arg is None for keyword in node.keywords):
            return self._unknown_call(node, name)
        new = "new " if len(chain) == 2 and self.program.is_class(chain) else ""
        return f"{new}{name}({self._bound(node, names)})"

    def _method_call(self, node: ast.Call, function: ast.Attribute) -> str:
        known = self.program.method_signatures(function.attr)
        if known and function.attr not in library.METHODS:
            if node.keywords and len(known) > 1:
                raise self.refuse(node, f"a call by name of {function.attr}, of which there are several")
            return f"{self.write(function)}({self._bound(node, next(iter(known)))})"
        if function.attr not in library.METHODS:
            raise self.refuse(node, f"the method {function.attr}")
        return f"{self.write(function.value)}.{library.METHODS[function.attr]}({self._given(node)})"

    def _unknown_call(self, node: ast.Call, function: str) -> str:
        named = [
            f"...Object.fromEntries({self.write(keyword.value)})"
            if keyword.arg is None
            else f"{keyword.arg}: {self.write(keyword.value)}"
            for keyword in node.keywords
        ]
        by_name = f", {{ {', '.join(named)} }}" if named else ""
        return f"call({function}, [{self.list_of(node.args)}]{by_name})"

    def _bound(self, node: ast.Call, names: Signature) -> str:
        """Return the arguments by place; those left out are undefined, so that defaults count."""
        if node.keywords and any(isinstance(argument, ast.Starred) for argument in node.args):
            raise self.refuse(node, "a call by name behind arguments of unknown number")
        given = [self.write(argument) for argument in node.args]
        by_name = {keyword.arg: self.write(keyword.value) for keyword in node.keywords}
        for name in by_name:
            if name not in names:
                raise self.refuse(node, f"the argument {name}")
        while by_name:
            given.append(by_name.pop(names[len(given)], "undefined"))
        return ", ".join(given)

    def _given(self, node: ast.Call) -> str:
        named = ", ".join(f"{keyword.arg}: {self.write(keyword.value)}" for keyword in node.keywords)
        return ", ".join([*map(self.write, node.args), *([f"kw({{ {named} }})"] if named else [])])
