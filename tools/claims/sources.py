"""Values that claims are held against: of tables, of marked parts of pages, of settings, code and texts."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.config.read import CONFIGURATION, read_merged, read_yaml
from tools.claims.manifest import (
    RESULTS,
    CodeSource,
    Found,
    PageSource,
    Reduction,
    Source,
    Study,
    TableSource,
    TextSource,
    YamlSource,
)
from tools.claims.prose import NUMBER, quotations, value_of
from tools.docs.marks import PART
from tools.docs.results import read_table


class NoValueError(ValueError):
    """A source that does not give a value; the message says which and why."""


@dataclass(frozen=True)
class Sources:
    """Sources by name, as they lie in the current folder; each file is read once.

    Attributes:
        named: What the manifest calls them.
        results: Folder of the study's results.
        study: Whose results these are.
    """

    named: Mapping[str, Source]
    results: Path
    study: Study
    _tables: dict[Path, pd.DataFrame] = field(default_factory=dict)

    def asked(self, found: Found) -> bool:
        """Tell whether a value is asked of this study; what the repository holds always is."""
        source = self.named[found.of]
        if not (isinstance(source, TableSource) and source.path.startswith(RESULTS)):
            return True
        return self.study == "full" or (self.study == "small" and source.holds == "any")

    def value(self, found: Found) -> float:
        """Return the value that a source gives.

        Raises:
            NoValueError: The source is missing, or does not give one number.
        """
        source = self.named[found.of]
        try:
            return found.times * _reduced(self._values(source, found), found.by)
        except FileNotFoundError as error:
            raise NoValueError(f"{error.filename} does not exist: {source.made_by}") from error
        except (ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError) as error:
            raise NoValueError(f"{found.of}, {found.value}: {error}") from error

    def _values(self, source: Source, found: Found) -> FloatArray:
        if isinstance(source, TableSource):
            return _column(self._table(self.place(source.path)), found)
        if isinstance(source, PageSource):
            return _of_page(Path(source.path), source.part, found)
        if isinstance(source, TextSource):
            return _of_text(Path(source.path), found.value)
        plain = _of_yaml(source, found) if isinstance(source, YamlSource) else _of_code(source, found)
        return np.atleast_1d(np.asarray(plain, dtype=np.float64))

    def place(self, path: str) -> Path:
        """Return where a file lies: one of the results in the folder that the configuration names."""
        return self.results / path.removeprefix(RESULTS) if path.startswith(RESULTS) else Path(path)

    def _table(self, path: Path) -> pd.DataFrame:
        if path not in self._tables:
            self._tables[path] = read_table(path)
        return self._tables[path]


def _column(table: pd.DataFrame, found: Found) -> FloatArray:
    """Return the values of the rows that count; shape (rows,)."""
    chosen = table.query(found.where, engine="python") if found.where else table
    if chosen.empty:
        raise NoValueError(f"no row where {found.where}")
    if found.by in {"count", "distinct"}:
        return np.unique(chosen[found.value], return_inverse=True)[1].astype(np.float64)
    return np.asarray(chosen.eval(found.value, engine="python"), dtype=np.float64)


def _of_page(path: Path, part: str, found: Found) -> FloatArray:
    """Return the first number of each cell in a column of a marked part's table."""
    bodies = [m["body"] for m in PART.finditer(path.read_text(encoding="utf-8")) if m["name"] == part]
    if not bodies:
        raise NoValueError(f"{path} has no part {part!r}")
    table = next((each for each in _tables_of(bodies[0]) if found.value in each.columns), None)
    if table is None:
        raise NoValueError(f"{path}, part {part!r}: no column is called {found.value!r}")
    chosen = table.query(found.where, engine="python") if found.where else table
    first = [NUMBER.search(cell) for cell in chosen[found.value]]
    return np.array([value_of(match[0]) for match in first if match], dtype=np.float64)


def _tables_of(markdown: str) -> list[pd.DataFrame]:
    """Return the tables of a Markdown text, cells as text without what makes them bold."""
    blocks = [block.strip().splitlines() for block in markdown.split("\n\n") if block.strip().startswith("|")]
    tables = [[_cells(line) for line in block] for block in blocks]
    return [pd.DataFrame(rows[2:], columns=_told_apart(rows[0])) for rows in tables]


def _told_apart(names: Sequence[str]) -> list[str]:
    """Return names with a number behind each that stood before: "Recordings", "Recordings (2)"."""
    counts = [names[: i + 1].count(name) for i, name in enumerate(names)]
    return [f"{name} ({n})" if n > 1 else name for name, n in zip(names, counts, strict=True)]


def _cells(line: str) -> list[str]:
    return [cell.strip().strip("*") for cell in line.strip().strip("|").split(" | ")]


def _of_text(path: Path, quoted: str) -> FloatArray:
    places = quotations(quoted, path.read_text(encoding="utf-8"))
    return np.array([value_of(number) for place in places for number in place.numbers], dtype=np.float64)


def _of_yaml(source: YamlSource, found: Found) -> Any:  # noqa: ANN401
    path = Path(source.path)
    value: Any = read_merged(path) if path.name == CONFIGURATION else read_yaml(path)
    for key in found.value.split("."):
        value = value[key]
    return range(len(value)) if found.by == "count" else value


def _of_code(source: CodeSource, found: Found) -> Any:  # noqa: ANN401
    value = getattr(importlib.import_module(source.module), found.value)
    return range(len(value)) if found.by == "count" else value


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


def _reduced(values: FloatArray, by: Reduction) -> float:
    reduced = float(REDUCTIONS[by](values))
    if not np.isfinite(reduced):
        raise NoValueError(f"the value is {reduced}")
    return reduced
