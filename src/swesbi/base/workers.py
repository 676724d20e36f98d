"""Work side by side: in threads, none of which outlives its call, and in processes that end with this one."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, copy_context
from dataclasses import dataclass
from itertools import repeat
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, Final, TypeVar

from threadpoolctl import threadpool_limits

from swesbi.base.terminal import ASKING_TO_END

Item = TypeVar("Item")
Result = TypeVar("Result")

LIMIT: Final = "OMP_NUM_THREADS"
"""The variable of the environment that says how many threads a process may use.

Snakemake sets it for its jobs, and libraries of linear algebra obey it too.
"""
POLL_S: Final = 0.2
CLEANING_S: Final = 2.0
"""How long a process that is asked to end may take to remove what it was making."""
EXIT_ORPHAN: Final = 3
EXIT_TERMINATED: Final = 128 + signal.SIGTERM


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


class WorkerKilledError(RuntimeError):
    """The process that had the work was killed, or has crashed; the message says by what."""


@dataclass(frozen=True)
class _WorkError:
    """An error of the work itself."""

    error: Exception


def side_by_side(
    work: Callable[[Item], Result], items: Sequence[Item], count: int
) -> Iterator[tuple[Item, Result | WorkerKilledError]]:
    """Yield each item with what the work returns for it, in the order in which they are done.

    Forked processes take one item after the other, each with one thread. One that is killed costs the item
    that it had; another takes its place. They end with this process, in whichever way it ends. An error of
    the work is raised here.
    """
    left = deque(items)
    idle: list[_Worker] = []
    busy: dict[Any, tuple[_Worker, Item]] = {}
    try:
        while left or busy:
            while left and len(busy) < count:
                worker = idle.pop() if idle else _Worker(work)
                busy[worker.connection] = worker, left.popleft()
                worker.give(busy[worker.connection][1])
            for connection in wait(list(busy)):
                worker, item = busy[connection]
                found = worker.found()
                if isinstance(found, _WorkError):
                    raise found.error
                del busy[connection]
                if not isinstance(found, WorkerKilledError):
                    idle.append(worker)
                yield item, found
    finally:
        _end([*idle, *(worker for worker, _ in busy.values())])


def in_processes(work: Callable[[Item], None], items: Sequence[Item]) -> None:
    """Do the work for every item in processes, as many as may run at once; here, where that is one.

    WorkerKilledError: one of them was killed.
    """
    count = min(usable(), len(items))
    if count <= 1:
        for item in items:
            work(item)
        return
    for _, found in side_by_side(work, items, count):
        if isinstance(found, WorkerKilledError):
            raise found


class _Worker:
    """A process that does the work for one item after the other."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        context = get_context("fork")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(work, theirs, os.getpid()), daemon=True)
        # a signal must not meet the child with the handlers of this process
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ASKING_TO_END)
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    def give(self, item: object) -> None:
        with contextlib.suppress(BrokenPipeError):  # killed meanwhile: found() says so
            self.connection.send(item)

    def found(self) -> Any:  # noqa: ANN401
        """Return what the work returned, a `_WorkError`, or a `WorkerKilledError`."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            return WorkerKilledError(_how_it_ended(self.process.exitcode or 0))


def _how_it_ended(code: int) -> str:
    if code in (-signal.SIGKILL, EXIT_TERMINATED):
        name = "SIGKILL" if code == -signal.SIGKILL else "SIGTERM"
        return f"its process was killed ({name}), probably because the memory ran out"
    return f"its process crashed ({signal.Signals(-code).name if code < 0 else f'exit code {code}'})"


def _serve(work: Callable[[Any], Any], connection: Connection[Any, Any], parent: int) -> None:
    """Do the work for what the parent sends, until it ends this process or is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent reports Ctrl-C
    signal.signal(signal.SIGTERM, _exit_unheard)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKING_TO_END)
    _exit_unless(lambda: os.getppid() == parent)
    os.environ[LIMIT] = "1"
    threadpool_limits(limits=1)  # threads that the parent had started do not exist here
    while True:
        connection.send(_tried(work, connection.recv()))


def _exit_unheard(*_: object) -> None:
    sys.unraisablehook = lambda _: None  # what is half made says nothing as it goes
    sys.exit(EXIT_TERMINATED)


def _tried(work: Callable[[Any], Any], item: object) -> Any:  # noqa: ANN401
    try:
        return work(item)
    except Exception as error:
        error.add_note(traceback.format_exc())  # which is lost on the way
        return _WorkError(error)


def _end(workers: Sequence[_Worker]) -> None:
    """End processes, those that do not clean up in time by force."""
    for worker in workers:
        worker.process.terminate()
    until = time.monotonic() + CLEANING_S
    for worker in workers:
        worker.process.join(max(0.0, until - time.monotonic()))
        worker.process.kill()
        worker.process.join()
        worker.connection.close()


def exit_when_gone(pid: int) -> None:
    """End this process at once, from now on, when the process with this number is gone.

    A job that outlives a killed run would write its result later, beside or over that of the next run,
    which may have other settings by then.
    """
    _exit_unless(lambda: is_alive(pid))


def _exit_unless(wanted: Callable[[], bool]) -> None:
    threading.Thread(target=_watch, args=(wanted,), daemon=True, name="watch").start()


def _watch(wanted: Callable[[], bool]) -> None:
    while wanted():
        time.sleep(POLL_S)
    # not sys.exit, which ends the thread alone: nothing of this process is wanted any more
    os._exit(EXIT_ORPHAN)


def is_alive(process: int) -> bool:
    """Tell whether a process of this machine runs."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True
