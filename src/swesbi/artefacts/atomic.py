"""Writing a file whole or not at all, and saying why it could not be written."""

from __future__ import annotations

import errno
import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from swesbi.artefacts.errors import ArtefactError

REMEDIES: Final = {
    errno.ENOSPC: "the disk is full: free some space, then run the same command again",
    errno.EDQUOT: "the disk quota is used up: free some space, then run the same command again",
    errno.EROFS: "the folder is on a read-only file system: make it writable, or name another `results:`",
    errno.EACCES: "permission denied: make the folder writable, or name another `results:`",
    errno.EPERM: "not permitted: make the folder writable, or name another `results:`",
    errno.EIO: "the disk reports an input/output error: look at the disk before running again",
}


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` that becomes ``path`` when the block ends without error.

    A reader, or a run that was interrupted, therefore sees the old file, the new one or none. What a
    killed process left of the same file is removed first.

    Raises:
        ArtefactError: The file cannot be written: disk full, folder read-only or not permitted.
    """
    temporary: Path | None = None
    try:
        temporary = _temporary(path)
        yield temporary
        _settle(temporary)
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        if (reason := write_fault(error)) is None:
            raise
        raise ArtefactError(f"{path}: cannot be written, {reason}; nothing was left behind") from error
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def write_fault(error: BaseException) -> str | None:
    """Return why a file cannot be written and what to do, or None if the error is of another nature.

    HDF5 reports the system's error number in the text of its own errors alone.
    """
    number = error.errno if isinstance(error, OSError) else None
    if number in REMEDIES:
        return REMEDIES[number]
    for known, remedy in REMEDIES.items():
        if os.strerror(known) in str(error):
            return remedy
    return None


def _temporary(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".{path.stem}-{socket.gethostname()}-"
    for left in path.parent.glob(f"{_literal(prefix)}*{_literal(path.suffix)}"):
        writer = left.name.removeprefix(prefix).split("-")[0]
        if writer.isdecimal() and not is_alive(int(writer)):
            left.unlink(missing_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f"{prefix}{os.getpid()}-", suffix=path.suffix)
    os.close(handle)
    return Path(name)


def _literal(text: str) -> str:
    """Return text that a glob pattern takes as it is."""
    return "".join(f"[{character}]" if character in "*?[" else character for character in text)


def is_alive(process: int) -> bool:
    """Tell whether a process of this machine runs."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _settle(temporary: Path) -> None:
    """Have the content on the disk before the name points to it, so that a power cut leaves no empty file."""
    temporary.chmod(0o644)
    with temporary.open("rb") as file:
        os.fsync(file.fileno())
