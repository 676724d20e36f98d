"""How a command ends: with which exit code, by Ctrl-C, by SIGTERM, or since nobody reads what it prints."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, NoReturn

EXIT_REFUSED: Final = 2
"""Of a command that something given is of no use to; what can be done without it has been done."""
EXIT_UNREAD: Final = 141
"""As shells have it of SIGPIPE."""
ASKING_TO_END: Final = (signal.SIGINT, signal.SIGTERM)
LONGEST_S: Final = 4
"""After which a process that is asked to end is ended by the kernel, whatever it is in the midst of."""
AGAIN_S: Final = 0.05


class InterruptedBySignal(KeyboardInterrupt):  # noqa: N818
    """Ends a command as Ctrl-C does, by a signal with this number."""

    def __init__(self, number: int) -> None:
        self.number = number

    @property
    def exit_code(self) -> int:
        """As shells have it of a process that a signal has ended."""
        return 128 + self.number


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Have Ctrl-C and SIGTERM end the block by InterruptedBySignal, once.

    What comes later does not disturb the removal of files.
    """
    before = {each: signal.signal(each, _end) for each in ASKING_TO_END}
    hook, sys.unraisablehook = sys.unraisablehook, _end_later
    try:
        yield
    finally:
        signal.alarm(0)
        sys.unraisablehook = hook
        for each, handler in before.items():
            signal.signal(each, handler)


def _end(number: int, _: object) -> NoReturn:
    for each in ASKING_TO_END:
        signal.signal(each, signal.SIG_IGN)
    signal.alarm(LONGEST_S)
    raise InterruptedBySignal(number)


def _end_later(lost: sys.UnraisableHookArgs) -> None:
    """Send a signal again that came where Python cannot raise: as an object was removed, say."""
    if not isinstance(lost.exc_value, InterruptedBySignal):
        sys.__unraisablehook__(lost)
        return
    number = lost.exc_value.number
    signal.signal(number, _end)
    threading.Timer(AGAIN_S, os.kill, (os.getpid(), number)).start()


def print_to_nobody() -> None:
    """Have what is printed from now on, also what is kept until the end, go nowhere: the reader is gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
