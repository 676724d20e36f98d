"""What reaches a terminal: text that others wrote, none of whose signs moves the cursor or hides words."""

from __future__ import annotations

from typing import Any, Final, TextIO, cast

LAYOUT: Final = "\n\t"


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
