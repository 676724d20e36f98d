"""What cannot be translated is refused, with its place."""

from __future__ import annotations

import ast
from pathlib import Path


class UntranslatableError(ValueError):
    """Code that the translator does not know; the message has file, line and what it is."""


def refused(path: Path, node: ast.AST, what: str) -> UntranslatableError:
    """Return the refusal of a node of the syntax tree of a file."""
    line = getattr(node, "lineno", 0)
    return UntranslatableError(
        f"{path}:{line}: {what} is not translated to JavaScript; write it plainer, or teach it to "
        "explorer.translation"
    )
