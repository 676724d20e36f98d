"""Threads for work that leaves the interpreter, as many as this process may use; none outlives its call."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, copy_context
from itertools import repeat
from typing import Final, TypeVar

Item = TypeVar("Item")

LIMIT: Final = "OMP_NUM_THREADS"
"""The variable of the environment that says how many threads a process may use.

Snakemake sets it for its jobs, and libraries of linear algebra obey it too.
"""


def usable() -> int:
    """Return how many threads may run at once: what ``LIMIT`` says, else every processor of this process."""
    stated = os.environ.get(LIMIT, "")
    if not stated:
        # macOS does not bind a process to processors
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    outermost = stated.split(",")[0].strip()  # further numbers are for threads that start threads
    if not (outermost.isdecimal() and int(outermost)):
        raise ValueError(f"{LIMIT} = {stated!r}: is no number of threads; set it to 1 or more, or unset it")
    return int(outermost)


def in_threads(work: Callable[[Item], None], items: Sequence[Item]) -> None:
    """Do the work for every item, side by side, and return when all is done.

    It must not depend on the order. The threads end with this call, so that no process is forked beside one.
    The first error of the work, in the order of the items, is raised here; what has not begun is left out
    then, as it is when Ctrl-C comes.
    """
    count = min(usable(), len(items))
    if count <= 1:
        for item in items:
            work(item)
        return
    contexts = [copy_context() for _ in items]  # to which numpy's handling of errors belongs
    pool = ThreadPoolExecutor(count)
    try:
        for _ in pool.map(Context.run, contexts, repeat(work), items):
            pass
    finally:
        pool.shutdown(cancel_futures=True)
