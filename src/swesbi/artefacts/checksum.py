"""The checksum at the end of an artefact: SHA-256 of every byte before it.

Neither HDF5 nor torch notices a flipped bit in the arrays. HDF5 ignores what follows its own content and a
zip archive has room for a comment, so files with this line at their end open everywhere, and without this
package ``head -c -80 FILE | sha256sum`` gives what ``tail -c 80 FILE`` says.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Final

PREFIX: Final = b"\nswesbi sha256 "
DIGITS: Final = 64
LENGTH: Final = len(PREFIX) + DIGITS + 1
BLOCK: Final = 1 << 20


def append_checksum(path: Path) -> None:
    """Add the checksum of a file at its end."""
    line = PREFIX + _digest(path, path.stat().st_size) + b"\n"
    with path.open("ab") as file:
        file.write(line)


def has_checksum(path: Path) -> bool:
    """Tell whether a file ends with a checksum, right or wrong."""
    return _stated(path) is not None


def check_bytes(path: Path) -> None:
    """Compare a file with the checksum at its end.

    Raises:
        ValueError: There is none, so the file is cut off or not this package's, or it differs.
        OSError: The file cannot be read.
    """
    stated = _stated(path)
    if stated is None:
        raise ValueError(
            "has no checksum at its end: it was cut off, or written or changed by other software"
        )
    if stated != _digest(path, path.stat().st_size - LENGTH):
        raise ValueError("does not match its checksum: its content has changed since it was written")


def _stated(path: Path) -> bytes | None:
    """Return the digest that the end of the file states."""
    with path.open("rb") as file:
        if file.seek(0, os.SEEK_END) < LENGTH:
            return None
        file.seek(-LENGTH, os.SEEK_END)
        line = file.read()
    if not (line.startswith(PREFIX) and line.endswith(b"\n")):
        return None
    return line[len(PREFIX) : -1]


def _digest(path: Path, length: int) -> bytes:
    """Return the hexadecimal SHA-256 of the first ``length`` bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while length > 0 and (block := file.read(min(BLOCK, length))):
            digest.update(block)
            length -= len(block)
    return digest.hexdigest().encode()
