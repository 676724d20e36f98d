"""Figures as the page shows them: a PNG beside the page, and the PDF behind it where there is one."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

from swesbi.artefacts import ArtefactError
from swesbi.report.files import relative

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
SIZE_AT = slice(16, 24)


@dataclass(frozen=True)
class Figure:
    """One figure: where it lies, its size in pixels, what it says to who cannot see it, and its caption."""

    source: str
    full: str
    width: int
    height: int
    description: str
    caption: str


def figure(png: Path, page: Path, description: str, caption: str, pdf: Path | None = None) -> Figure:
    """Return a figure of the page; a click leads to the PDF, or to the PNG where there is none.

    Raises:
        ArtefactError: The file is no PNG.
    """
    width, height = _size(png)
    return Figure(relative(png, page), relative(pdf or png, page), width, height, description, caption)


def _size(png: Path) -> tuple[int, int]:
    with png.open("rb") as file:
        head = file.read(SIZE_AT.stop)
    if not head.startswith(PNG_SIGNATURE) or len(head) < SIZE_AT.stop:
        raise ArtefactError(f"{png}: is not a PNG image; delete it and rerun")
    width, height = struct.unpack(">II", head[SIZE_AT])
    return width, height
