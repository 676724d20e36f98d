"""Expressions of Python in JavaScript: collections and texts, and how each kind of expression is written."""

from __future__ import annotations

import ast
import json
from collections.abc import Callable, Mapping
from typing import ClassVar

from explorer.translation import library, syntax
from explorer.translation.calls import Calls


class Expressions(Calls):
    """Writes the expressions of one function."""

    def write(self, node: ast.expr) -> str:
        """Return an expression in JavaScript; an UntranslatableError says where it has what is not known."""
        handler = self._HANDLERS.get(type(node))
        if handler is None:
            raise self.refuse(node, type(node).__name__)
        return handler(self, node)

    def _subscript(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Subscript)
        return f"getItem({self.write(node.value)}, {self.index(node.slice)})"

    def index(self, node: ast.expr) -> str:
        """Return what stands between brackets."""
        return self.list_of(node.elts) if isinstance(node, ast.Tuple) else self.write(node)

    def _slice(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Slice)
        parts = ["null" if part is None else self.write(part) for part in (node.lower, node.upper, node.step)]
        return f"py.slice({', '.join(parts)})"

    def _list(self, node: ast.expr) -> str:
        assert isinstance(node, ast.List | ast.Tuple)
        return f"[{self.list_of(node.elts)}]"

    def _set(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Set)
        return f"py.set([{self.list_of(node.elts)}])"

    def _starred(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Starred)
        return f"...each({self.write(node.value)})"

    def _dict(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Dict)
        pairs = [
            f"...{self.write(value)}" if key is None else f"[{self.write(key)}, {self.write(value)}]"
            for key, value in zip(node.keys, node.values, strict=True)
        ]
        return f"new Map([{', '.join(pairs)}])"

    def _comprehension(self, node: ast.expr) -> str:
        assert isinstance(node, ast.ListComp | ast.GeneratorExp | ast.SetComp | ast.DictComp)
        sequence = self.write(node.generators[0].iter)
        outer = self.scope
        for part in node.generators:
            self.scope = {**self.scope, **dict.fromkeys(syntax.stored_names(part.target))}
        text = self._loops(node, sequence, 0)
        self.scope = outer
        if isinstance(node, ast.SetComp):
            return f"py.set({text})"
        return f"new Map({text})" if isinstance(node, ast.DictComp) else text

    def _loops(
        self, node: ast.ListComp | ast.GeneratorExp | ast.SetComp | ast.DictComp, sequence: str, depth: int
    ) -> str:
        part = node.generators[depth]
        pattern, source = self.pattern(part.target), f"each({sequence})"
        if depth + 1 < len(node.generators):
            value = self._loops(node, self.write(node.generators[depth + 1].iter), depth + 1)
        elif isinstance(node, ast.DictComp):
            value = f"[[{self.write(node.key)}, {self.write(node.value)}]]"
        else:
            value = f"[{self.write(node.elt)}]"
        # a condition may bind what the value names, so that each item passes both before the next
        condition = " && ".join(map(self.test, part.ifs))
        return f"{source}.flatMap(({pattern}) => {f'({condition} ? {value} : [])' if condition else value})"

    def pattern(self, target: ast.expr) -> str:
        """Return the target of an assignment in a loop."""
        if isinstance(target, ast.Name):
            return library.identifier(target.id)
        if isinstance(target, ast.Tuple):
            return f"[{', '.join(map(self.pattern, target.elts))}]"
        raise self.refuse(target, "this target")

    def _lambda(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Lambda)
        names = list(syntax.parameter_names(node.args))
        outer, self.scope = self.scope, {**self.scope, **dict.fromkeys(names)}
        text = f"(({', '.join(map(library.identifier, names))}) => {self.write(node.body)})"
        self.scope = outer
        return text

    # --- texts

    def _text(self, node: ast.expr) -> str:
        assert isinstance(node, ast.JoinedStr)
        return " + ".join(['""', *map(self._part, node.values)]) if node.values else '""'

    def _part(self, node: ast.expr) -> str:
        if isinstance(node, ast.Constant):
            return json.dumps(node.value)
        assert isinstance(node, ast.FormattedValue)
        if node.conversion == ord("r"):
            return f"py.repr({self.write(node.value)})"
        spec = '""' if node.format_spec is None else self._text(node.format_spec)
        return f"format({self.write(node.value)}, {spec})"

    _HANDLERS: ClassVar[Mapping[type[ast.expr], Callable[[Expressions, ast.expr], str]]] = {
        ast.Constant: Calls._constant,
        ast.Name: Calls._name,
        ast.Attribute: Calls._name,
        ast.BinOp: Calls._binary,
        ast.UnaryOp: Calls._unary,
        ast.BoolOp: Calls._boolean,
        ast.Compare: Calls._compare,
        ast.IfExp: Calls._choice,
        ast.NamedExpr: Calls._walrus,
        ast.Call: Calls._call,
        ast.Subscript: _subscript,
        ast.Slice: _slice,
        ast.List: _list,
        ast.Tuple: _list,
        ast.Set: _set,
        ast.Starred: _starred,
        ast.Dict: _dict,
        ast.ListComp: _comprehension,
        ast.GeneratorExp: _comprehension,
        ast.SetComp: _comprehension,
        ast.DictComp: _comprehension,
        ast.Lambda: _lambda,
        ast.JoinedStr: _text,
    }
