"""Read a MATLAB file of versions 5 to 7 by SciPy and print it as JSON: ``python mat_loader.py FILE``.

Some damaged files take the interpreter down with SciPy, so it reads in a process of its own.
"""

from __future__ import annotations

import json
import resource
import sys
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatlabFunction, MatlabOpaque
from scipy.sparse import issparse

MOST_VALUES = 5_000_000
MOST_BYTES = 4 * 1024**3  # of memory; a small file may swell to any size


def described(value: Any) -> dict[str, Any]:  # noqa: ANN401
    """Return a variable as ``mat_child.Loaded`` takes it: kind, shape and content, column by column."""
    if issparse(value):
        return {"kind": "sparse", "shape": ()}
    if isinstance(value, MatlabOpaque | MatlabFunction):
        return {"kind": "object", "shape": ()}
    array = np.asarray(value)
    plain: dict[str, Any] = {"kind": "number", "shape": array.shape}
    if array.size > MOST_VALUES:
        return plain | {"kind": "too large"}
    if array.dtype.names is not None:
        items = array.ravel(order="F")
        fields = {name: [described(item[name]) for item in items] for name in array.dtype.names}
        return plain | {"kind": "struct", "fields": fields}
    if array.dtype.kind == "O":
        return plain | {"kind": "cell", "cells": [described(item) for item in array.ravel(order="F")]}
    if array.dtype.kind in "US":
        return plain | {"kind": "char", "rows": [str(row).rstrip() for row in array.ravel()]}
    if array.dtype.kind == "c":
        return plain | {"kind": "complex"}
    return plain | {"numbers": array.ravel(order="F").astype(np.float64).tolist()}


def main() -> None:
    """Print the variables of the file that the command line names."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    variables = loadmat(sys.argv[1], squeeze_me=False, chars_as_strings=True)
    known = {name: described(value) for name, value in variables.items() if not name.startswith("__")}
    # what MATLAB keeps of its own classes stands under a name of no letters
    if any(
        not name.startswith(("__header", "__version", "__globals")) for name in variables if name[:2] == "__"
    ):
        known["#subsystem#"] = {"kind": "object", "shape": ()}
    json.dump(known, sys.stdout)


if __name__ == "__main__":
    main()
