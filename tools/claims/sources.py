"""Values that claims are held against: of tables, of settings, of code and of texts."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.config.read import CONFIGURATION, read_merged, read_yaml
from tools.claims.manifest import Reduction, ValueSource
from tools.claims.prose import quotations, value_of
from tools.docs.directives import QUERY_ERRORS, Place, read_table

MODULE: Final = ("swesbi.", "tools.")


class NoValueError(ValueError):
    """A source that does not give a value; the message says which and why."""


def value_found(source: str, found: ValueSource, place: Place) -> float:
    """Return the value that a source, a path or module, gives; not one number is a NoValueError."""
    try:
        value = found.times * float(REDUCTIONS[found.by](_values(source, found, place)))
    except FileNotFoundError as error:
        raise NoValueError(f"{error.filename} does not exist") from error
    except QUERY_ERRORS as error:
        raise NoValueError(f"{found.of}, {found.value}: {error}") from error
    if not np.isfinite(value):
        raise NoValueError(f"the value is {value}")
    return value


def _values(source: str, found: ValueSource, place: Place) -> FloatArray:
    if source.startswith(MODULE):
        return _plain(getattr(importlib.import_module(source), found.value), found)
    path = place(source)
    if path.suffix == ".csv":
        return _of_table(path, found)
    if path.suffix == ".yaml":
        value: Any = read_merged(path) if path.name == CONFIGURATION else read_yaml(path)
        for key in found.value.split("."):
            value = value[key]
        return _plain(value, found)
    quoted = quotations(found.value, path.read_text(encoding="utf-8"))
    return np.array([value_of(number) for each in quoted for number in each.numbers], dtype=np.float64)


def _of_table(path: Path, found: ValueSource) -> FloatArray:
    """Return the values of the rows that count; shape (rows,)."""
    table = read_table(path)
    chosen = table.query(found.where, engine="python") if found.where else table
    if found.by in {"count", "distinct"}:
        return np.unique(chosen[found.value], return_inverse=True)[1].astype(np.float64)
    if chosen.empty:
        raise NoValueError(f"no row where {found.where}")
    return np.asarray(chosen.eval(found.value, engine="python"), dtype=np.float64)


def _plain(value: Any, found: ValueSource) -> FloatArray:  # noqa: ANN401
    """Return a value of settings or code; of several that are counted, their positions."""
    return np.atleast_1d(np.asarray(range(len(value)) if found.by == "count" else value, dtype=np.float64))


def _only(values: FloatArray) -> float:
    if len(values) != 1:
        raise NoValueError(f"{len(values)} values where one is asked for")
    return float(values[0])


REDUCTIONS: Final[Mapping[Reduction, Callable[[FloatArray], float]]] = {
    "only": _only,
    "sum": np.sum,
    "mean": np.mean,
    "median": np.median,
    "min": np.min,
    "max": np.max,
    "count": len,
    "distinct": lambda values: len(np.unique(values)),
}
