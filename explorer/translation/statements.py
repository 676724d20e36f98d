"""Statements, functions and classes in JavaScript."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar, Final

from explorer.translation import syntax
from explorer.translation.calls import INDENT, Program
from explorer.translation.expressions import Expressions
from explorer.translation.library import identifier
from explorer.translation.modules import Module, resolved

FREE_DECORATORS: Final = {"property", "classmethod", "staticmethod", "dataclass", "runtime_checkable"}
CACHES: Final = {"lru_cache", "cache"}
VALIDATORS: Final = {"model_validator", "field_validator"}
"""Checks of settings, which are made before anything is translated."""


def decorators(node: ast.FunctionDef | ast.ClassDef) -> set[str]:
    """Return the names of the decorators of a definition, without what they are called with."""
    roots = (part.func if isinstance(part, ast.Call) else part for part in node.decorator_list)
    return {ast.unparse(root).rsplit(".", maxsplit=1)[-1] for root in roots}


class Statements(Expressions):
    """Writes the statements of one function, a line each."""

    def block(self, statements: list[ast.stmt]) -> list[str]:
        """Return statements, indented."""
        return [f"{INDENT}{line}" for statement in statements for line in self.statement(statement)]

    def statement(self, node: ast.stmt) -> list[str]:
        """Return the lines of a statement; an UntranslatableError says where it has what is not known."""
        if syntax.is_text(node):
            return []
        handler = self._STATEMENTS.get(type(node))
        if handler is None:
            raise self.refuse(node, type(node).__name__)
        return handler(self, node)

    def _assign(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.Assign)
        value = self.write(node.value)
        if len(node.targets) == 1:
            return self._stored(node.targets[0], value)
        stores = [line for target in node.targets for line in self._stored(target, "value")]
        return ["{", f"{INDENT}const value = {value};", *(f"{INDENT}{line}" for line in stores), "}"]

    def _annotated(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.AnnAssign)
        return [] if node.value is None else self._stored(node.target, self.write(node.value))

    def _stored(self, target: ast.expr, value: str) -> list[str]:
        if isinstance(target, ast.Name):
            return [f"{identifier(target.id)} = {value};"]
        if isinstance(target, ast.Attribute):
            return [f"{self.write(target)} = {value};"]
        if isinstance(target, ast.Subscript):
            return [f"setItem({self.write(target.value)}, {value}, {self.index(target.slice)});"]
        if isinstance(target, ast.Tuple):
            return self._unpacked(target, value)
        raise self.refuse(target, "this target")

    def _unpacked(self, target: ast.Tuple, value: str) -> list[str]:
        starred = next((k for k, part in enumerate(target.elts) if isinstance(part, ast.Starred)), -1)
        parts = [part.value if isinstance(part, ast.Starred) else part for part in target.elts]
        if not all(isinstance(part, ast.Name) for part in parts):
            name = f"parts{target.lineno}_{target.col_offset}"
            lines = [f"const {name} = unpacked({value}, {len(parts)}, {starred});"]
            for k, part in enumerate(parts):
                lines += self._stored(part, f"{name}[{k}]")
            return ["{", *(f"{INDENT}{line}" for line in lines), "}"]
        names = ", ".join(map(self.pattern, parts))
        return [f"[{names}] = unpacked({value}, {len(parts)}, {starred});"]

    def _augmented(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.AugAssign)
        load = ast.copy_location(ast.parse(ast.unparse(node.target), mode="eval").body, node.target)
        for part in ast.walk(load):
            ast.copy_location(part, node)
        value = f"py.inplace(py.{self.operator(node.op, node)}, {self.write(load)}, {self.write(node.value)})"
        return self._stored(node.target, value)

    def _return(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.Return)
        return ["return null;" if node.value is None else f"return {self.write(node.value)};"]

    def _if(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.If)
        lines = [f"if ({self.test(node.test)}) {{", *self.block(node.body)]
        if node.orelse:
            lines += ["} else {", *self.block(node.orelse)]
        return [*lines, "}"]

    def _for(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.For)
        label = f"whole{node.lineno}"
        head = f"for (const item of each({self.write(node.iter)})) {{"
        inner = [f"{INDENT}{line}" for line in self._stored(node.target, "item")]
        loop = [head, *inner, *self.block(node.body), "}"]
        if not node.orelse:
            return loop
        if any(isinstance(part, ast.For | ast.While) for part in syntax.nested(node.body)):
            raise self.refuse(node, "a loop with else around another loop")
        # else runs where nothing broke off: a break leaves the block around both
        broken = [line.replace("break;", f"break {label};") for line in loop]
        return [f"{label}: {{", *(f"{INDENT}{line}" for line in broken), *self.block(node.orelse), "}"]

    def _while(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.While)
        if node.orelse:
            raise self.refuse(node, "while with else")
        return [f"while ({self.test(node.test)}) {{", *self.block(node.body), "}"]

    def _raise(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.Raise)
        if node.exc is None:
            raise self.refuse(node, "raise without an error")
        text = self.write(node.exc)
        return [f"throw {text if text.startswith('new ') else f'new {text}'};"]

    def _try(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.Try)
        if node.orelse or node.finalbody or len(node.handlers) != 1 or node.handlers[0].type is None:
            raise self.refuse(node, "try with more than one except")
        handler = node.handlers[0]
        assert handler.type is not None
        caught = f"{INDENT}if (!(error instanceof {self.write(handler.type)})) throw error;"
        name = [f"{INDENT}{identifier(handler.name)} = error;"] if handler.name else []
        return [
            "try {",
            *self.block(node.body),
            "} catch (error) {",
            caught,
            *name,
            *self.block(handler.body),
            "}",
        ]

    def _with(self, node: ast.stmt) -> list[str]:
        """Write what stands within; what numpy warns of, and how many threads run, is nothing here."""
        assert isinstance(node, ast.With)
        for item in node.items:
            if ast.unparse(item.context_expr).split("(")[0] not in {"np.errstate", "threadpool_limits"}:
                raise self.refuse(node, ast.unparse(item.context_expr))
        return ["{", *self.block(node.body), "}"]

    def _import(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.Import | ast.ImportFrom)
        self.scope |= {name: resolved(chain) for name, chain in self.module.targets(node).items()}
        return []

    def _inner_function(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.FunctionDef)
        return function_lines(node, self.module, self.program, self.scope)

    def _expression(self, node: ast.stmt) -> list[str]:
        assert isinstance(node, ast.Expr)
        if isinstance(node.value, ast.Yield):
            return [f"yield {'null' if node.value.value is None else self.write(node.value.value)};"]
        if isinstance(node.value, ast.Call) and ast.unparse(node.value.func) == "super().__init__":
            # of errors alone, whose constructor has begun with that of JavaScript
            return [f"this.message = text({self.list_of(node.value.args)});"]
        return [f"{self.write(node.value)};"]

    _STATEMENTS: ClassVar[Mapping[type[ast.stmt], Callable[[Statements, ast.stmt], list[str]]]] = {
        ast.Assign: _assign,
        ast.AnnAssign: _annotated,
        ast.AugAssign: _augmented,
        ast.Return: _return,
        ast.If: _if,
        ast.For: _for,
        ast.While: _while,
        ast.Raise: _raise,
        ast.Try: _try,
        ast.With: _with,
        ast.Import: _import,
        ast.ImportFrom: _import,
        ast.FunctionDef: _inner_function,
        ast.Expr: _expression,
        ast.Break: lambda self, node: ["break;"],  # noqa: ARG005
        ast.Continue: lambda self, node: ["continue;"],  # noqa: ARG005
        ast.Pass: lambda self, node: [],  # noqa: ARG005
    }


def parameters(node: ast.FunctionDef) -> list[ast.arg]:
    """Return the parameters of a function that has neither ``*args`` nor ``**kwargs``, ``self`` included."""
    return [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]


def defaults(node: ast.FunctionDef) -> dict[str, ast.expr]:
    """Return the default values of a function by the name of the parameter."""
    by_place = [*node.args.posonlyargs, *node.args.args]
    places = by_place[len(by_place) - len(node.args.defaults) :]
    known = {part.arg: value for part, value in zip(places, node.args.defaults, strict=True)}
    for part, value in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True):
        if value is not None:
            known[part.arg] = value
    return known


def _head(writer: Expressions, node: ast.FunctionDef, skipped: int) -> str:
    known = defaults(node)
    names = [
        f"{identifier(part.arg)} = {writer.write(known[part.arg])}"
        if part.arg in known
        else identifier(part.arg)
        for part in parameters(node)[skipped:]
    ]
    if node.args.kwarg is not None:
        raise writer.refuse(node, "a function of any arguments")
    if node.args.vararg is not None:
        names.append(f"...{identifier(node.args.vararg.arg)}")
    return ", ".join(names)


def _body(
    node: ast.FunctionDef, module: Module, program: Program, outer: Mapping[str, syntax.Chain | None]
) -> tuple[Statements, list[str]]:
    given = set(syntax.parameter_names(node.args))
    bound = dict.fromkeys([*syntax.bound_by(node.body), *_walrus_names(node), *_caught_names(node)])
    writer = Statements(module, {**outer, **dict.fromkeys(given), **bound}, program)
    functions = {part.name for part in syntax.nested(node.body) if isinstance(part, ast.FunctionDef)}
    inner = [identifier(name) for name in bound if name not in given | functions]
    lines = writer.block(node.body)
    return writer, [*([f"{INDENT}let {', '.join(inner)};"] if inner else []), *lines]


def _walrus_names(node: ast.FunctionDef) -> Iterator[str]:
    return (part.target.id for part in ast.walk(node) if isinstance(part, ast.NamedExpr))


def _caught_names(node: ast.FunctionDef) -> Iterator[str]:
    return (part.name for part in ast.walk(node) if isinstance(part, ast.ExceptHandler) and part.name)


def function_lines(
    node: ast.FunctionDef,
    module: Module,
    program: Program,
    outer: Mapping[str, syntax.Chain | None],
    name: str = "",
) -> list[str]:
    """Return the lines of a function, with the names of its parameters for calls by name."""
    called = name or identifier(node.name)
    writer, body = _body(node, module, program, outer)
    names = ", ".join(f'"{part.arg}"' for part in parameters(node))
    cached = [f"{called} = py.cached({called});"] if decorators(node) & CACHES else []
    star = "*" if any(isinstance(part, ast.Yield) for part in ast.walk(node)) else ""
    return [
        f"function{star} {called}({_head(writer, node, 0)}) {{",
        *body,
        "}",
        f"{called}.parameters = [{names}];",
        *cached,
    ]


def method_lines(node: ast.FunctionDef, module: Module, program: Program) -> list[str]:
    """Return the lines of a method, a class method, a static method or a property."""
    marks = decorators(node)
    writer, body = _body(node, module, program, {})
    if "staticmethod" in marks:
        return [f"static {node.name}({_head(writer, node, 0)}) {{", *body, "}"]
    first = f"{INDENT}const {parameters(node)[0].arg} = this;"
    kind = "get " if marks & {"property", "cached_property"} else "static " if "classmethod" in marks else ""
    return [f"{kind}{METHOD_NAMES.get(node.name, node.name)}({_head(writer, node, 1)}) {{", first, *body, "}"]


METHOD_NAMES: Final = {"__str__": "str_", "__len__": "len_", "__post_init__": "postInit_"}
