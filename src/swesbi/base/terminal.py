"""A command at a terminal: with which exit code it ends, by which signal, and what of a text is printed.

Texts that others wrote reach the terminal without signs that move the cursor or hide words.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, NoReturn, TextIO, cast

EXIT_REFUSED: Final = 2
"""Of a command that something given is of no use to; what can be done without it has been done."""
EXIT_UNREAD: Final = 141
"""As shells have it of SIGPIPE."""
ASKING_TO_END: Final = (signal.SIGINT, signal.SIGTERM)
LONGEST_S: Final = 4
"""After which a process that is asked to end is ended by the kernel, whatever it is in the midst of."""
AGAIN_S: Final = 0.05
LAYOUT: Final = "\n\t"


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
    except InterruptedBySignal as interrupted:
        traceback.clear_frames(interrupted.__traceback__)
        raise
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
    """Send a signal again that came where Python cannot raise: as an object was removed, say.

    What a signal left half made says nothing as it goes.
    """
    if not isinstance(lost.exc_value, InterruptedBySignal):
        if signal.getsignal(signal.SIGTERM) is not signal.SIG_IGN:
            sys.__unraisablehook__(lost)
        return
    number = lost.exc_value.number
    signal.signal(number, _end)
    threading.Timer(AGAIN_S, os.kill, (os.getpid(), number)).start()


def print_to_nobody() -> None:
    """Have what is printed from now on, also what is kept until the end, go nowhere: the reader is gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def printable(text: str) -> str:
    r"""Return a text in which signs that cannot be printed stand as their escapes: ``\x1b``, ``\u200b``.

    Line breaks and tabulators stay.
    """
    if text.isprintable():
        return text
    return "".join(
        sign if sign.isprintable() or sign in LAYOUT else sign.encode("unicode_escape").decode("ascii")
        for sign in text
    )


def visible(text: str) -> str:
    """Return a text without the signs that cannot be seen; a blank of any width is a blank."""
    return "".join(sign for sign in text if sign.isprintable() or sign.isspace())


def hidden_signs(text: str) -> str:
    """Name the signs of a text that cannot be seen by their code points: " (with U+200B)"; else nothing."""
    codes = dict.fromkeys(f"U+{ord(sign):04X}" for sign in text if not sign.isprintable())
    return f" (with {', '.join(codes)})" if codes else ""


class _Terminal:
    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(printable(text))

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._stream, name)


def terminal(stream: TextIO) -> TextIO:
    """Return a stream that writes to this one what is printable of a text."""
    return cast("TextIO", _Terminal(stream))
