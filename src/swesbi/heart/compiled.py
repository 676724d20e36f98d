"""How the numerical functions are compiled: no exceptions, fused multiply-adds, inlined into one loop.

A branch that raises keeps the compiler from turning the loop over lanes into SIMD code. So division by zero
gives infinity (``error_model="numpy"``), and what fails is found by its NaN after the beat.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

LOGGER = logging.getLogger("swesbi")
P = ParamSpec("P")
R = TypeVar("R")
# "contract" allows fused multiply-adds, "nsz" ignores the sign of zero, "arcp" turns division by a
# common denominator into a product, "reassoc" takes sums and products in the order of the fewest.
# NaN and infinity keep their meaning: the status relies on them, so "fast", which assumes that there are
# none, is not an option.
_FAST: set[str] = {"contract", "nsz", "arcp", "reassoc"}


def equation(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a scalar function that is always inlined, so that a loop over lanes becomes SIMD code."""
    jit: Any = numba.njit(error_model="numpy", fastmath=_FAST, forceinline=True)
    return cast("Callable[P, R]", jit(function))


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop that threads can run, and keep the machine code on disk, where a folder takes it."""
    jit: Any = numba.njit(error_model="numpy", fastmath=_FAST, nogil=True, cache=True)
    try:
        return cast("Callable[P, R]", jit(function))
    except RuntimeError:  # neither beside the source nor in the user's cache
        LOGGER.warning(
            "every process compiles the model anew, ten seconds or more: no folder takes its machine code; "
            "set NUMBA_CACHE_DIR to one that can be written"
        )
        jit = numba.njit(error_model="numpy", fastmath=_FAST, nogil=True)
        return cast("Callable[P, R]", jit(function))


def source_key() -> int:
    """Return a number that changes with any source file of this package.

    A kernel that closes over it is compiled anew after an edit to a file it inlines; the cache on
    disk looks at the kernel's own file only.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big")
