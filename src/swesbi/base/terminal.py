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
