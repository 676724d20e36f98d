"""Compiled loops in JavaScript: what they call is written into them, and every record is taken apart.

What ``heart.compiled`` has the compiler do, this does: a function marked ``equation`` is inlined, named
tuples become local variables, and branches on options are decided here, since options are constants of a
study. What is left is plain arithmetic on doubles, in Python's order, that every browser compiles well.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, Final

from explorer.translation import syntax
from explorer.translation.atoms import Atom, Constant, Number, Record, Several, View, shown
from explorer.translation.loop_expressions import Lines, LoopExpressions, known
from explorer.translation.modules import Module, resolved, value_of

UNROLLED: Final = 32
"""Loops of so many constant rounds are written out."""


class Inliner(LoopExpressions):
    """Executes the statements of one function while it is translated."""

    def run(self, statements: Sequence[ast.stmt]) -> Atom | None:
        """Write statements and return what the first ``return`` that is reached gives; None where none is."""
        for statement in statements:
            if syntax.is_text(statement):
                continue
            if isinstance(statement, ast.Return):
                return Constant(None) if statement.value is None else self.value(statement.value)
            if isinstance(statement, ast.If):
                returned = self._if(statement)
                if returned is not None:
                    return returned
                continue
            handler = self._STATEMENTS.get(type(statement))
            if handler is None:
                raise self.refuse(statement, type(statement).__name__)
            handler(self, statement)
        return None

    def _if(self, node: ast.If) -> Atom | None:
        test = self.value(node.test)
        if isinstance(test, Constant):
            return self.run(node.body if test.value else node.orelse)
        if node.orelse or not all(isinstance(part, ast.Expr) for part in node.body):
            raise self.refuse(node, "a branch that is not known beforehand and does more than call")
        self.out.open(f"if ({shown(test)}) {{")
        self.run(node.body)
        self.out.close()
        return None

    def _assign(self, node: ast.stmt) -> None:
        assert isinstance(node, ast.Assign)
        if len(node.targets) != 1:
            raise self.refuse(node, "an assignment to several targets")
        self._store(node.targets[0], self.value(node.value))

    def _store(self, target: ast.expr, value: Atom) -> None:
        if isinstance(target, ast.Name):
            self.names[target.id] = value
        elif (
            isinstance(target, ast.Tuple)
            and isinstance(value, Several)
            and len(value.parts) == len(target.elts)
        ):
            for part, inner in zip(target.elts, value.parts, strict=True):
                self._store(part, inner)
        elif isinstance(target, ast.Subscript):
            self._write(target, value)
        else:
            raise self.refuse(target, "this target")

    def _write(self, target: ast.Subscript, value: Atom) -> None:
        place = self._part(target)
        assert isinstance(place, View)
        if not place.shape:
            self.out.add(f"{place.data}[{place.offset}] = {shown(value)};")
            return
        if len(place.shape) != 1:
            raise self.refuse(target, "writing into a part of several axes")
        k = self.out.name("k")
        at = place.at(k)
        self.out.add(
            f"for (let {k} = 0; {k} < {place.shape[0]}; {k}++) {at.data}[{at.offset}] = {shown(value)};"
        )

    def _augmented(self, node: ast.stmt) -> None:
        assert isinstance(node, ast.AugAssign)
        load = ast.BinOp(_loaded(node.target), node.op, node.value)
        self._store(node.target, self.value(ast.fix_missing_locations(ast.copy_location(load, node))))

    def _for(self, node: ast.stmt) -> None:
        assert isinstance(node, ast.For)
        if node.orelse:
            raise self.refuse(node, "for with else")
        rounds = self._rounds(node.iter)
        if rounds is not None:
            for item in rounds:
                self._store(node.target, item)
                if self.run(node.body) is not None:
                    raise self.refuse(node, "return within a loop")
            return
        self._loop(node)

    def _rounds(self, sequence: ast.expr) -> list[Atom] | None:
        """Return the items of a sequence that is known; None of a range that is not."""
        if isinstance(sequence, ast.Call) and ast.unparse(sequence.func) == "range":
            counts = [self.value(argument) for argument in sequence.args]
            if not all(isinstance(count, Constant) for count in counts):
                return None
            constant = range(*(count.value for count in counts if isinstance(count, Constant)))
            return [Constant(k) for k in constant] if len(constant) <= UNROLLED else None
        items = self.value(sequence)
        if isinstance(items, Several):
            return list(items.parts)
        raise self.refuse(sequence, "this sequence")

    def _loop(self, node: ast.For) -> None:
        """Write a loop; what it assigns is its own, and is not read behind it."""
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        if len(node.iter.args) != 1:
            raise self.refuse(node.iter, "a range with a beginning")
        end = shown(self.value(node.iter.args[0]))
        k = self.out.name(node.target.id)
        outer = dict(self.names)
        clash = {*syntax.bound_by(node.body)} & outer.keys()
        if clash:
            raise self.refuse(node, f"a loop that changes {', '.join(sorted(clash))} from outside")
        self.names[node.target.id] = Number(k)
        self.out.open(f"for (let {k} = 0; {k} < {end}; {k}++) {{")
        if self.run(node.body) is not None:
            raise self.refuse(node, "return within a loop")
        self.out.close()
        self.names = outer

    def _expression(self, node: ast.stmt) -> None:
        assert isinstance(node, ast.Expr)
        self.value(node.value)

    _STATEMENTS: ClassVar[Mapping[type[ast.stmt], Callable[[Inliner, ast.stmt], None]]] = {
        ast.Assign: _assign,
        ast.AugAssign: _augmented,
        ast.For: _for,
        ast.Expr: _expression,
    }


def _loaded(target: ast.expr) -> ast.expr:
    return ast.parse(ast.unparse(target), mode="eval").body


def loop_lines(
    home: Module,
    node: ast.FunctionDef,
    name: str,
    ranks: Mapping[str, int],
    constants: Mapping[str, object],
    given: Mapping[syntax.Chain, object],
) -> list[str]:
    """Return a compiled loop as a function of JavaScript that takes arrays of the runtime.

    ``ranks`` has the number of axes of each array among its parameters, ``constants`` what functions around
    it hold, and ``given`` values of the package that are others here.
    """
    out = Lines()
    names = {key: known(value) for key, value in constants.items()}
    parameters = [part.arg for part in node.args.args]
    for parameter, part in zip(parameters, node.args.args, strict=True):
        names[parameter] = _parameter(out, parameter, part, ranks, home)
    Inliner(home, names, out, given).run(node.body)
    return [f"function {name}({', '.join(parameters)}) {{", *out.lines, "}"]


def _parameter(out: Lines, name: str, part: ast.arg, ranks: Mapping[str, int], home: Module) -> Atom:
    if name in ranks:
        out.add(f"const {name}_d = {name}.data;")
        axes = range(ranks[name])
        for k in axes:
            out.add(f"const {name}_n{k} = {name}.shape[{k}], {name}_s{k} = {name}.strides[{k}];")
        return View(
            f"{name}_d",
            f"{name}.offset",
            tuple(f"{name}_n{k}" for k in axes),
            tuple(f"{name}_s{k}" for k in axes),
        )
    kind = ast.unparse(part.annotation) if part.annotation else ""
    chain = home.chain_of(kind)
    if chain is None:
        return Number(name)
    fields = value_of(resolved(chain))._fields  # type: ignore[attr-defined]
    for field in fields:
        out.add(f"const {name}_{field} = {name}.{field};")
    return Record({field: Number(f"{name}_{field}") for field in fields})
