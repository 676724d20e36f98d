"""What a variable of a compiled loop is while it is translated: constant, number, record, tuple or array."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from explorer.translation.values import number

ARITHMETIC: Final[Mapping[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv),
}
COMPARED: Final[Mapping[type[ast.cmpop], tuple[str, Callable[[Any, Any], bool]]]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("===", operator.eq),
}


@dataclass(frozen=True)
class Constant:
    """A value that is known when the loop is translated."""

    value: Any


@dataclass(frozen=True)
class Number:
    """A number or truth of the running loop, by its expression: a name, or something short."""

    text: str


@dataclass(frozen=True)
class Record:
    """A named tuple, field by field: in the loop it is no object."""

    fields: Mapping[str, Atom]


@dataclass(frozen=True)
class Several:
    """A tuple."""

    parts: tuple[Atom, ...]


@dataclass(frozen=True)
class View:
    """An array or a part of one: its buffer, where it begins, its lengths and strides."""

    data: str
    offset: str
    shape: tuple[str, ...]
    strides: tuple[str, ...]

    def at(self, index: str) -> View:
        """Return the part at one place of the first axis."""
        return View(
            self.data, f"{self.offset} + ({index}) * {self.strides[0]}", self.shape[1:], self.strides[1:]
        )


Atom: TypeAlias = Constant | Number | Record | Several | View


def shown(atom: Atom) -> str:
    """Return a constant or a number as an expression."""
    if isinstance(atom, Constant) and isinstance(atom.value, int | float):
        text = str(atom.value).lower() if isinstance(atom.value, bool) else number(atom.value)
        return f"({text})" if text.startswith("-") else text
    if isinstance(atom, Number):
        return atom.text
    raise TypeError(f"{atom} is no single number")
