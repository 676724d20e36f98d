"""A lock that the kernel takes back from a process that dies, however it dies.

Snakemake marks what a run works on with files, which a killed run leaves behind. Every run therefore also
holds this lock: who gets it alone knows that no run is alive, and that such files are left-overs.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def held_with_others(path: Path, when_alone: Callable[[], None]) -> Iterator[None]:
    """Hold the lock beside other runs; first, if there is none, do what only a lone run may.

    Where the file system knows no such locks, ``when_alone`` is never called.

    Args:
        path: The lock's file, which stays; its folder is made if need be.
        when_alone: Called while no other process holds the lock.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        if _lock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB):
            when_alone()
        _lock(handle, fcntl.LOCK_SH)
        yield
    finally:
        os.close(handle)


def _lock(handle: int, mode: int) -> bool:
    try:
        fcntl.flock(handle, mode)
    except OSError:
        return False
    return True
