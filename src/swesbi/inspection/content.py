"""What a file of the study holds, whatever its format: facts, settings, arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Array:
    """One array: ``values`` of numbers or text, along named dimensions."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    units: str = ""
    meaning: str = ""

    @property
    def is_numeric(self) -> bool:
        """Whether the values are numbers."""
        return self.values.dtype.kind in "biuf"


@dataclass(frozen=True)
class Content:
    """One file.

    Attributes:
        path: The file.
        what: What it is, in a few words.
        integrity: What its checksum says; empty where the format has none.
        origin: How it was made: version, code hash, seed, subject.
        settings: The settings behind it, nested keys joined by dots.
        facts: What else it says of itself.
        arrays: Its arrays.
    """

    path: Path
    what: str
    integrity: str
    origin: Mapping[str, str]
    settings: Mapping[str, str]
    facts: Mapping[str, str]
    arrays: tuple[Array, ...]


def flatten(plain: object, key: str = "") -> dict[str, str]:
    """Return nested plain data as text by key: ``{"prior": {"low": 2}}`` becomes ``{"prior.low": "2"}``."""
    return dict(_leaves(plain, key))


def _leaves(plain: object, key: str) -> Iterator[tuple[str, str]]:
    if isinstance(plain, dict):
        for name, value in plain.items():
            yield from _leaves(value, f"{key}.{name}" if key else str(name))
    elif isinstance(plain, list) and any(isinstance(item, dict | list) for item in plain):
        for index, value in enumerate(plain):
            yield from _leaves(value, f"{key}[{index}]")
    elif isinstance(plain, list | tuple):
        yield key, ", ".join(map(str, plain))
    else:
        yield key, str(plain)


def as_text(values: object) -> NDArray[Any]:
    """Return values as an array of text."""
    return np.asarray(values).astype(str)
