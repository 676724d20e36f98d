"""Processes that share what this one has in memory."""

from __future__ import annotations

import signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from threadpoolctl import threadpool_limits


def forked_processes(count: int) -> ProcessPoolExecutor:
    """Return so many processes, made at their first task, each with one thread."""
    return ProcessPoolExecutor(count, mp_context=get_context("fork"), initializer=one_thread)


def one_thread() -> None:
    """Let libraries use one thread: those that their parent had started do not exist in a forked process.

    Only the parent reports Ctrl-C.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(limits=1)
