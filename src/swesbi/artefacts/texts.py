"""Texts as files, written whole or not at all: one, or each of several under its own name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from swesbi.artefacts.atomic import atomic_path


class TextFile:
    """The format of a text, or of texts by the names of their files without suffix."""

    def write(self, text: str | Mapping[str, str], path: Path) -> None:
        """Write the text of this file in UTF-8.

        Raises:
            KeyError: There is none.
        """
        with atomic_path(path) as temporary:
            temporary.write_text(text if isinstance(text, str) else text[path.stem], encoding="utf-8")


Text = Annotated[str, TextFile()]
"""A text that is a file: LaTeX, HTML, YAML."""
Texts = Annotated[Mapping[str, str], TextFile()]
"""Texts that are files of one output, by their names without suffix."""
