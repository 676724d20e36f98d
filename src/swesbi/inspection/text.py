"""A file of the study as text on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from swesbi.inspection.content import Array, Content

HEADER: Final = ("array", "dimensions", "units", "missing", "min", "median", "mean", "max", "meaning")
LEFT: Final = frozenset({"file", "array", "dimensions", "units", "meaning"})
SHOWN_TEXTS: Final = 4


def as_lines(content: Content) -> list[str]:
    """Return what a file is, how it was made, and a row for each of its arrays."""
    lines = [str(content.path), f"  {content.what}"]
    lines += [f"  {content.integrity}"] if content.integrity else []
    for title, facts in (
        ("made by", content.origin),
        ("settings", content.settings),
        ("says", content.facts),
    ):
        lines += [f"  {title}:", *_pairs(facts)] if facts else []
    if content.arrays:
        lines += ["  arrays:", *(f"    {line}" for line in table(list(map(_row, content.arrays))))]
    return lines


def _pairs(facts: Mapping[str, str]) -> list[str]:
    width = max(map(len, facts))
    return [f"    {name:<{width}}  {value}" for name, value in facts.items()]


def table(rows: Sequence[Sequence[str]], header: Sequence[str] = HEADER) -> list[str]:
    """Return rows of text as aligned lines below a header, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    return [
        "  ".join(
            text.ljust(width) if name in LEFT else text.rjust(width)
            for text, width, name in zip(row, widths, header, strict=True)
        ).rstrip()
        for row in (header, *rows)
    ]


def _row(array: Array) -> tuple[str, ...]:
    sizes = zip(array.dims, array.values.shape, strict=True)
    dims = " x ".join(f"{name} {size}" for name, size in sizes) or "scalar"
    return (array.name, dims, array.units, *_statistics(array), array.meaning or _texts(array))


def _statistics(array: Array) -> tuple[str, ...]:
    """Return how many values are missing, and minimum, median, mean and maximum of the others."""
    if not array.is_numeric:
        return ("", "", "", "", "")
    values = array.values.astype(np.float64)
    finite = values[np.isfinite(values)]
    missing = str(values.size - finite.size)
    if not finite.size:
        return (missing, "", "", "", "")
    return (missing, *(f"{f(finite):.5g}" for f in (np.min, np.median, np.mean, np.max)))


def _texts(array: Array) -> str:
    """Return the first few different texts of an array of text."""
    if array.is_numeric:
        return ""
    different = list(dict.fromkeys(map(str, array.values.ravel())))
    more = f", ... ({len(different)} different)" if len(different) > SHOWN_TEXTS else ""
    return ", ".join(different[:SHOWN_TEXTS]) + more
