"""Writing a file whole or not at all, and what is said of a file that is not what it should be."""

from __future__ import annotations

import errno
import glob
import os
import secrets
import shlex
import shutil
import socket
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from swesbi.base.workers import is_alive

REMEDIES: Final = {
    errno.ENOSPC: "the disk is full: free some space, then run the same command again",
    errno.EDQUOT: "the disk quota is used up: free some space, then run the same command again",
    errno.EROFS: "the folder is on a read-only file system: name another folder (`results:`, `--out`)",
    errno.EACCES: "permission denied: make the folder writable, or name another one (`results:`, `--out`)",
    errno.EPERM: "not permitted: make the folder writable, or name another one (`results:`, `--out`)",
    errno.EIO: "the disk reports an input/output error: look at the disk before running again",
}
UNSUPPORTED: Final = (errno.EPERM, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS)
"""Of drives under WSL, FUSE and object stores, whose files are written all the same."""


class ArtefactError(ValueError):
    """A file that is not the artefact it should be; the message says which, why and what to do."""


class UnfitError(ArtefactError):
    """An input of a stage that does not fit the others; whoever knows its file says which it is."""

    def __init__(self, name: str, fault: str) -> None:
        super().__init__(name, fault)
        self.name = name
        self.fault = fault

    def __str__(self) -> str:
        return f"{self.name}: {self.fault}"


class DamagedArtefactError(ArtefactError):
    """A file that has to be made again; the message ends with the command that does it."""

    def __init__(self, path: Path, fault: str) -> None:
        super().__init__(path, fault)
        self.path = path
        self.fault = fault

    def __str__(self) -> str:
        return self.message()

    def message(self, options: str = "") -> str:
        """Return the message for a study that Snakemake runs under these command-line options."""
        return f"{self.path}: {self.fault}; delete it and rerun: {repair_command(self.path, options)}"


def repair_command(path: Path, options: str = "") -> str:
    """Return the shell command that makes a file of the study anew, relative to the current folder.

    ``options`` are what the study is run with beside the target (``--configfile tests/smoke.yaml``, say).
    """
    return f"rm -f {_target(path)} && {make_command([path], options)}"


def make_command(paths: Sequence[Path], options: str = "") -> str:
    """Return the shell command that makes files of the study that do not exist; arguments as above."""
    return " ".join(filter(None, (typed("snakemake", "--cores", "2", *paths), options)))


def typed(program: str, *words: str | Path) -> str:
    """Return the shell command of a program of this environment, by its path where no shell knows it.

    Words that are paths below the current folder become relative to it.
    """
    beside = Path(sys.executable).with_name(program)
    known = shutil.which(program) or not beside.exists()
    return " ".join([program if known else _target(beside), *(_target(Path(word)) for word in words)])


def _target(path: Path) -> str:
    within = path.is_absolute() and path.is_relative_to(Path.cwd())
    return shlex.quote(os.path.relpath(path) if within else str(path))


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` that becomes ``path`` when the block ends without error.

    A reader, or a run that was interrupted, therefore sees the old file, the new one or none. What a
    killed process left of the same file is removed first.
    """
    with _told(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        prefix = _own_prefix(path.parent, path.stem, path.suffix)
        temporary = path.with_name(f"{prefix}{secrets.token_hex(4)}{path.suffix}")
        temporary.touch(exist_ok=False)
        try:
            yield temporary
            # on the disk before the name points to it, so that a power cut leaves no empty file
            with temporary.open("rb") as file, where_supported():
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Say in a sentence why a file or a folder cannot be written."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        if (reason := write_fault(error)) is None:
            raise
        raise ArtefactError(f"{path}: cannot be written, {reason}; nothing was left behind") from error


def write_fault(error: BaseException) -> str | None:
    """Return why a file cannot be written and what to do, or None if the error is of another nature.

    HDF5 reports the system's error number in the text of its own errors alone.
    """
    for number, remedy in REMEDIES.items():
        if number == getattr(error, "errno", None) or os.strerror(number) in str(error):
            return remedy
    return None


def _own_prefix(folder: Path, name: str, suffix: str = "") -> str:
    """Return how this process begins a temporary name in a folder; what killed ones left there is removed."""
    prefix = f".{name}-{socket.gethostname()}-"
    for left in list(folder.glob(f"{glob.escape(prefix)}*{glob.escape(suffix)}")):
        writer = left.name.removeprefix(prefix).split("-")[0]
        if writer.isdecimal() and not is_alive(int(writer)):
            shutil.rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)
    return f"{prefix}{os.getpid()}-"


@contextmanager
def where_supported() -> Iterator[None]:
    """Let a file system do without what it lacks, such as a word of when a file is on the disk."""
    try:
        yield
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise


@contextmanager
def folder_made_whole(folder: Path, last: str = "") -> Iterator[Path]:
    """Yield a temporary folder whose files go into ``folder`` when the block ends without error.

    What else lies there stays. After an error, or Ctrl-C, nothing is left behind. What a killed process left
    of the same folder is removed first. The file named ``last`` goes last: where it lies all others do.
    """
    existing = next(path for path in folder.absolute().parents if path.is_dir())
    with _told(folder):
        prefix = _own_prefix(existing, folder.name)
        with tempfile.TemporaryDirectory(prefix=prefix, dir=existing) as made:
            try:
                yield Path(made)
            except ArtefactError as error:
                if made not in str(error):
                    raise
                raise ArtefactError(str(error).replace(made, str(folder))) from error
            files = (file for file in Path(made).rglob("*") if file.is_file())
            for path in sorted(files, key=lambda file: (file.name == last, file)):
                kept = folder / path.relative_to(made)
                kept.parent.mkdir(parents=True, exist_ok=True)
                path.replace(kept)
