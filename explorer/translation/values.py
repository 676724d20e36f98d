"""Values that are known when the page is made, as JavaScript: constants of modules, and settings."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
from pydantic import BaseModel

from explorer.translation.refusal import UntranslatableError

Reference = Callable[[str, str], str]
"""Of a module and a name, what the definition is called in JavaScript."""


def literal(value: object, reference: Reference) -> str:
    """Return a value as an expression of JavaScript; ``reference`` tells the names of classes and functions.

    Numbers, texts, bytes, collections, arrays, settings, dataclasses and named tuples can be written.
    """
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, Enum | int | float | np.number):
        return number(value.value if isinstance(value, Enum) else value)
    return _compound(value, reference)


def number(value: Any) -> str:  # noqa: ANN401
    """Return a number, to the last bit."""
    if isinstance(value, int):
        return str(value)
    plain = float(value)
    if math.isinf(plain) or math.isnan(plain):
        return {True: "Infinity", False: "-Infinity"}[plain > 0] if math.isinf(plain) else "NaN"
    return repr(plain)


def _compound(value: Any, reference: Reference) -> str:  # noqa: ANN401
    def inner(part: object) -> str:
        return literal(part, reference)

    if isinstance(value, bytes):
        return f"new Content({list(value)})"
    if isinstance(value, slice):
        return f"py.slice({inner(value.start)}, {inner(value.stop)}, {inner(value.step)})"
    if isinstance(value, np.ndarray):
        return f"np.array({inner(value.tolist())})"
    named = _named_values(value)
    if named is not None:
        kind = reference(type(value).__module__, type(value).__qualname__)
        return f"new {kind}({', '.join(map(inner, named.values()))})"
    if isinstance(value, tuple | list | frozenset | set):
        return f"[{', '.join(map(inner, sorted(value) if isinstance(value, frozenset | set) else value))}]"
    if isinstance(value, Mapping):
        pairs = ", ".join(f"[{inner(key)}, {inner(part)}]" for key, part in value.items())
        return f"new Map([{pairs}])"
    if (
        isinstance(value, type)
        or callable(getattr(value, "__wrapped__", value))
        and getattr(value, "__module__", None)
    ):
        return reference(value.__module__, value.__qualname__)
    raise UntranslatableError(f"{value!r} is no value that JavaScript is given")


def _named_values(value: Any) -> dict[str, Any] | None:  # noqa: ANN401
    """Return the fields of settings, a dataclass or a named tuple, in order; None of anything else."""
    if isinstance(value, type):
        return None
    if isinstance(value, BaseModel):
        return {name: getattr(value, name) for name in type(value).model_fields}
    if is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    return value._asdict() if hasattr(value, "_asdict") else None
