"""What is said of a file that is not the artefact it should be, and the command that repairs it."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path


class ArtefactError(ValueError):
    """A file that is not the artefact it should be; the message says which, why and what to do."""


class DamagedArtefactError(ArtefactError):
    """A file that has to be made again; the message ends with the command that does it.

    Attributes:
        path: The file.
        fault: What is wrong with it.
    """

    def __init__(self, path: Path, fault: str) -> None:
        self.path = path
        self.fault = fault
        super().__init__(self.message())

    def message(self, options: str = "") -> str:
        """Return the message for a study that Snakemake runs under these command-line options."""
        return f"{self.path}: {self.fault}; delete it and rerun: {repair_command(self.path, options)}"


def repair_command(path: Path, options: str = "") -> str:
    """Return the shell command that makes a file of the study anew.

    Args:
        path: The file; targets of the workflow are relative to its folder, the current one.
        options: What the study is run with beside the target (``--configfile tests/smoke.yaml``, say).
    """
    return f"rm -f {_target(path)} && {make_command([path], options)}"


def make_command(paths: Sequence[Path], options: str = "") -> str:
    """Return the shell command that makes files of the study that do not exist; arguments as above."""
    return " ".join(filter(None, ("snakemake --cores 2", *map(_target, paths), options)))


def _target(path: Path) -> str:
    within = path.is_absolute() and path.is_relative_to(Path.cwd())
    return shlex.quote(os.path.relpath(path) if within else str(path))
