"""MATLAB files of versions 5 to 7, read by SciPy in a process of its own (:mod:`~.mat_loader`)."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.recording.mat_values import Vector, damaged, read_vectors

LOADER: Final = Path(__file__).with_name("mat_loader.py")
LONGEST_S: Final = 60.0


@dataclass(frozen=True)
class Loaded:
    """One variable, a ``MatVariable``, as the loader has printed it."""

    name: str
    plain: Mapping[str, Any]

    @property
    def kind(self) -> str:
        """What it is."""
        return str(self.plain["kind"])

    @property
    def shape(self) -> tuple[int, ...]:
        """Its dimensions."""
        return tuple(self.plain["shape"])

    def numbers(self) -> FloatArray:
        """Return its numbers, column by column."""
        return np.asarray(self.plain["numbers"], dtype=np.float64)

    def rows(self) -> list[str]:
        """Return the rows of a char matrix."""
        return list(self.plain["rows"])

    def cells(self) -> list[Loaded]:
        """Return the cells of a cell array."""
        return [Loaded(self.name, cell) for cell in self.plain["cells"]]

    def fields(self) -> dict[str, Loaded]:
        """Return the fields of a struct; of an array of structs each is a cell array."""
        several = int(np.prod(self.shape)) != 1
        return {
            name: Loaded(
                name, {"kind": "cell", "shape": (len(values), 1), "cells": values} if several else values[0]
            )
            for name, values in self.plain["fields"].items()
        }


def read_mat_v5(path: Path, names: Sequence[str]) -> dict[str, Vector]:
    """Return those of ``names`` that the file holds, from its variables or from one struct.

    Raises:
        MatValueError: It is no such file, or damaged, or a variable is neither numbers nor texts.
    """
    plain = _printed(path, hashlib.sha256(path.read_bytes()).hexdigest())
    return read_vectors({name: Loaded(name, value) for name, value in plain.items()}, names)


@lru_cache(maxsize=4)  # a recording is looked at several times, and each child takes a second
def _printed(path: Path, digest: str) -> dict[str, Any]:
    """Return the variables of a file with this content."""
    try:
        done = subprocess.run(
            [sys.executable, "-I", str(LOADER), str(path)],
            capture_output=True,
            timeout=LONGEST_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise damaged(f"it takes more than {LONGEST_S:.0f} s") from error
    if done.returncode == 0:
        return dict(json.loads(done.stdout))
    said = done.stderr.decode("utf-8", "replace").strip().splitlines()
    raise damaged(said[-1] if said and done.returncode > 0 else "SciPy dies of it")
