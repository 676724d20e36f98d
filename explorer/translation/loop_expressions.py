"""Expressions of compiled loops: each is computed once, and what they call is written into the loop."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from explorer.translation import syntax
from explorer.translation.atoms import (
    ARITHMETIC,
    COMPARED,
    Atom,
    Constant,
    Number,
    Record,
    Several,
    View,
    shown,
)
from explorer.translation.modules import Module, module, resolved, value_of
from explorer.translation.refusal import UntranslatableError, refused


class Lines:
    """The lines of a loop, and names for what they compute."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.depth = 1
        self._last = 0
        self._known: list[dict[str, str]] = [{}]

    def add(self, line: str) -> None:
        """Append a line."""
        self.lines.append("  " * self.depth + line)

    def name(self, stem: str = "t") -> str:
        """Return a new name."""
        self._last += 1
        return f"{stem}{self._last}"

    def number(self, expression: str) -> Number:
        """Compute an expression once and return its name."""
        name = self.name()
        self.add(f"const {name} = {expression};")
        return Number(name)

    def open(self, line: str) -> None:
        """Begin a block."""
        self.add(line)
        self.depth += 1

    def close(self) -> None:
        """End it."""
        self.depth -= 1
        self.add("}")


class LoopExpressions:
    """Works out the expressions of one function while it is translated, and writes what is left for the loop.

    Names are the function's and of those around it; values in ``given`` are others here than in the package.
    """

    def __init__(
        self, home: Module, names: dict[str, Atom], out: Lines, given: Mapping[syntax.Chain, object]
    ) -> None:
        self.module, self.names, self.out, self.given = home, names, out, given

    def refuse(self, node: ast.AST, what: str) -> UntranslatableError:
        """Return the refusal of a node."""
        return refused(self.module.path, node, f"{what} in a compiled loop")

    def run(self, statements: Sequence[ast.stmt]) -> Atom | None:
        """Write statements; a class of statements does."""
        raise NotImplementedError

    def value(self, node: ast.expr) -> Atom:
        """Return what an expression is; an UntranslatableError says where it has what is not known."""
        handler = self._EXPRESSIONS.get(type(node))
        if handler is None:
            raise self.refuse(node, type(node).__name__)
        return handler(self, node)

    def _constant(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Constant)
        return Constant(node.value)

    def _name(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Name)
        if node.id in self.names:
            return self.names[node.id]
        chain = self.module.chain_of(node.id)
        if chain is None:
            raise self.refuse(node, f"the name {node.id}")
        chain = resolved(chain)
        return known(self.given[chain] if chain in self.given else value_of(chain))

    def _attribute(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Attribute)
        value = self.value(node.value)
        if isinstance(value, Record) and node.attr in value.fields:
            return value.fields[node.attr]
        if isinstance(value, View) and node.attr == "shape":
            return Several(tuple(map(Number, value.shape)))
        if isinstance(value, View) and node.attr == "size" and len(value.shape) == 1:
            return Number(value.shape[0])
        if isinstance(value, Constant) and hasattr(value.value, node.attr):
            return known(getattr(value.value, node.attr))
        raise self.refuse(node, f"the attribute {node.attr}")

    def _arithmetic(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.BinOp)
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(node.op, ast.FloorDiv | ast.Mod):
            return self._whole(node.op, left, right)
        if type(node.op) not in ARITHMETIC:
            raise self.refuse(node, f"the operator {type(node.op).__name__}")
        sign, function = ARITHMETIC[type(node.op)]
        if isinstance(left, Constant) and isinstance(right, Constant):
            return Constant(function(left.value, right.value))
        return self.out.number(f"{shown(left)} {sign} {shown(right)}")

    def _whole(self, op: ast.operator, left: Atom, right: Atom) -> Atom:
        """Divide whole numbers that are not negative: steps and their places."""
        text = (
            f"Math.floor({shown(left)} / {shown(right)})"
            if isinstance(op, ast.FloorDiv)
            else f"{shown(left)} % {shown(right)}"
        )
        return self.out.number(text)

    def _unary(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.UnaryOp)
        value = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return Constant(not value.value) if isinstance(value, Constant) else Number(f"!({shown(value)})")
        if not isinstance(node.op, ast.USub):
            raise self.refuse(node, type(node.op).__name__)
        return Constant(-value.value) if isinstance(value, Constant) else Number(f"(-{shown(value)})")

    def _boolean(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.BoolOp)
        short = isinstance(node.op, ast.Or)
        open_values: list[str] = []
        for part in node.values:
            value = self.value(part)
            if isinstance(value, Constant):
                if bool(value.value) is short:
                    return (
                        Constant(short)
                        if not open_values
                        else self._joined(open_values, short, shown(Constant(short)))
                    )
            else:
                open_values.append(shown(value))
        return Constant(not short) if not open_values else self._joined(open_values, short)

    def _joined(self, values: list[str], short: bool, *more: str) -> Number:
        return Number(f"({(' || ' if short else ' && ').join([*values, *more])})")

    def _compare(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Compare)
        if len(node.ops) != 1 or type(node.ops[0]) not in COMPARED:
            raise self.refuse(node, "this comparison")
        left, right = self.value(node.left), self.value(node.comparators[0])
        sign, function = COMPARED[type(node.ops[0])]
        if isinstance(left, Constant) and isinstance(right, Constant):
            return Constant(function(left.value, right.value))
        return Number(f"({shown(left)} {sign} {shown(right)})")

    def _choice(self, node: ast.expr) -> Atom:
        """Both branches are arithmetic, so that computing them both changes nothing."""
        assert isinstance(node, ast.IfExp)
        test = self.value(node.test)
        if isinstance(test, Constant):
            return self.value(node.body if test.value else node.orelse)
        yes, no = self.value(node.body), self.value(node.orelse)
        return self.out.number(f"{shown(test)} ? {shown(yes)} : {shown(no)}")

    def _tuple(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Tuple)
        return Several(tuple(map(self.value, node.elts)))

    def _subscript(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Subscript)
        part = self._part(node)
        if isinstance(part, View) and not part.shape:
            return self.out.number(f"{part.data}[{part.offset}]")
        return part

    def _part(self, node: ast.Subscript) -> Atom:
        """Return the entry of a tuple, or the part of an array that an index names."""
        value = self.value(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(value, Several):
            index = self.value(indices[0])
            assert isinstance(index, Constant)
            part: Atom = value.parts[index.value]
            return part
        if not isinstance(value, View):
            raise self.refuse(node, "an index of what is no array")
        for index_node in indices:
            value = (
                self._sliced(value, index_node)
                if isinstance(index_node, ast.Slice)
                else value.at(shown(self.value(index_node)))
            )
        return value

    def _sliced(self, value: View, node: ast.Slice) -> View:
        """Return a slice of the last axis that is left, whose ends lie within it."""
        if len(value.shape) != 1 or node.step is not None:
            raise self.refuse(node, "a slice of several axes, or with a step")
        start = "0" if node.lower is None else shown(self.value(node.lower))
        stop = value.shape[0] if node.upper is None else shown(self.value(node.upper))
        offset = self.out.number(f"{value.offset} + {start} * {value.strides[0]}")
        length = self.out.number(f"{stop} - {start}")
        return View(value.data, offset.text, (length.text,), value.strides)

    # --- calls

    def _call(self, node: ast.expr) -> Atom:
        assert isinstance(node, ast.Call)
        name = ast.unparse(node.func)
        given = [self.value(argument) for argument in node.args]
        by_name = {keyword.arg or "": self.value(keyword.value) for keyword in node.keywords}
        if name in self._FUNCTIONS and name not in self.names:
            return self._FUNCTIONS[name](self, given)
        chain = self.module.chain_of(name)
        if chain is None:
            raise self.refuse(node, f"the function {name}")
        chain = resolved(chain)
        if chain in self.given:
            return known(self.given[chain])
        if chain in self._LIBRARY:
            return self._FUNCTIONS[self._LIBRARY[chain]](self, given)
        return self._own_call(node, chain, given, by_name)

    def _own_call(
        self, node: ast.Call, chain: syntax.Chain, given: list[Atom], by_name: dict[str, Atom]
    ) -> Atom:
        home = module(chain[0])
        definition = home.definition(chain[1])
        if isinstance(definition, ast.ClassDef):
            names = [
                part.target.id
                for part in definition.body
                if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name)
            ]
            return Record(dict(zip(names, given, strict=False)) | by_name)
        if not isinstance(definition, ast.FunctionDef) or "equation" not in map(
            ast.unparse, definition.decorator_list
        ):
            raise self.refuse(node, f"the function {chain[1]}, which is no equation")
        names = [part.arg for part in definition.args.args]
        inner = type(self)(home, dict(zip(names, given, strict=False)) | by_name, self.out, self.given)
        returned = inner.run(definition.body)
        return Constant(None) if returned is None else returned

    def _extreme(self, sign: str, given: list[Atom]) -> Atom:
        first, *others = map(shown, given)
        for other in others:
            first = self.out.number(f"{other} {sign} {first} ? {other} : {first}").text
        return Number(first)

    def _length(self, given: list[Atom]) -> Atom:
        assert isinstance(given[0], Several)
        return Constant(len(given[0].parts))

    _FUNCTIONS: ClassVar[Mapping[str, Callable[[LoopExpressions, list[Atom]], Atom]]] = {
        "max": lambda self, given: self._extreme(">", given),
        "min": lambda self, given: self._extreme("<", given),
        "abs": lambda self, given: self.out.number(f"Math.abs({shown(given[0])})"),
        "ceil": lambda self, given: self.out.number(f"Math.ceil({shown(given[0])})"),
        "len": _length,
    }
    _LIBRARY: ClassVar[Mapping[syntax.Chain, str]] = {("math", "ceil"): "ceil"}
    _EXPRESSIONS: ClassVar[Mapping[type[ast.expr], Callable[[LoopExpressions, ast.expr], Atom]]] = {
        ast.Constant: _constant,
        ast.Name: _name,
        ast.Attribute: _attribute,
        ast.BinOp: _arithmetic,
        ast.UnaryOp: _unary,
        ast.BoolOp: _boolean,
        ast.Compare: _compare,
        ast.IfExp: _choice,
        ast.Tuple: _tuple,
        ast.Subscript: _subscript,
        ast.Call: _call,
    }


def known(value: object) -> Atom:
    """Return a value that is known beforehand; a named tuple is a record, a tuple its parts."""
    if hasattr(value, "_asdict"):
        return Record({name: known(part) for name, part in value._asdict().items()})
    return Several(tuple(map(known, value))) if isinstance(value, tuple) else Constant(value)
