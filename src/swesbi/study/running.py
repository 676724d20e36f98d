"""Running the study as a whole: one run at a time, what a killed run left.

A killed Snakemake leaves two things: its lock files, and markers of the results that were being made. The
next run stops on both, for the sake of a run that may still be alive. Every run therefore also holds a lock
of the kernel: who gets it alone knows that no run is alive, and that such files are left over.
"""

from __future__ import annotations

import fcntl
import functools
import os
import shlex
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swesbi.artefacts.atomic import where_supported, write_fault
from swesbi.base.environment import of_another_folder
from swesbi.base.progress import LOGGER

if TYPE_CHECKING:  # commands that start no run read what runs left, without Snakemake
    from snakemake.exceptions import WorkflowError
    from snakemake.workflow import Workflow

RUN: Final = "current_run"
"""Key of the workflow's ``config`` that is no part of the study: process and options of the run."""
STATE: Final = Path(".snakemake")


def hold_with_others(path: Path, when_alone: Callable[[], None]) -> int:
    """Hold the lock beside other runs; first, if there is none, do what only a lone run may.

    Where the file system knows no such locks, ``when_alone`` is never called. The file of the lock stays. The
    open file is returned: the lock lasts until it is closed, which the end of the process does.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    if _lock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB):
        when_alone()
    _lock(handle, fcntl.LOCK_SH)
    return handle


def _lock(handle: int, mode: int) -> bool:
    try:
        fcntl.flock(handle, mode)
    except OSError:
        return False
    return True


def guard_run(workflow: Workflow, results: str) -> None:
    """Hold the lock of runs until this process ends, and remove what a killed run left.

    A Snakefile calls it. Nothing happens in the processes of single jobs, and a dry run changes nothing.
    Unfinished results are made again by ``rerun-incomplete`` of the profile: each is written whole, but
    perhaps under other settings.
    """
    if renew := of_another_folder():
        raise _refusal(renew)
    if shlex.quote(sys.executable) != sys.executable:
        raise _refusal(
            f"{sys.executable}: Snakemake writes this path into shell lines, which its blanks break; "
            f"rename the folder, or link to it (ln -s {shlex.quote(str(Path.cwd()))} ~/swesbi) and type "
            "`make clean install` there"
        )
    if workflow.is_main_process and not workflow.output_settings.dryrun:
        check_writable(Path(results))
        hold_with_others(STATE / "swesbi-run.lock", functools.partial(remove_stale_locks, STATE / "locks"))


def remove_stale_locks(folder: Path) -> None:
    """Remove Snakemake's lock files; to be called only when no run is alive."""
    if left := sorted(folder.glob("*.lock")):
        LOGGER.warning("The last run was killed: its locks are removed, what it was making is made again.")
    for path in left:
        path.unlink(missing_ok=True)


def check_writable(folder: Path) -> None:
    """Write and remove a file in a folder, or in the nearest one above it that exists."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.is_dir())
    try:
        with tempfile.NamedTemporaryFile(dir=existing, prefix=".swesbi-") as file:
            file.write(b"\0" * 4096)
            file.flush()
            with where_supported():
                os.fsync(file.fileno())
    except OSError as error:
        reason = write_fault(error) or str(error)
        raise _refusal(f"{folder}: results cannot be written, {reason}") from None


SKEW_S: Final = 2.0
"""By how much clocks of a network may differ; a job takes as long."""


def check_dates(inputs: Sequence[Path]) -> None:
    """Refuse inputs that are dated in the future: Snakemake takes what is made of them for older."""
    ahead = [path for path in inputs if path.is_file() and path.stat().st_mtime > time.time() + SKEW_S]
    if ahead:
        named = shlex.join(["touch", *map(str, ahead)])
        raise _refusal(
            f"{ahead[0]} is dated in the future, so that what is made of it would count as older; correct "
            f"the clock, or date it anew: {named}"
        )


def _refusal(message: str) -> WorkflowError:
    """Return the error that Snakemake prints without a traceback."""
    from snakemake.exceptions import WorkflowError

    return WorkflowError(message)


def current_run(workflow: Workflow) -> dict[str, int | str]:
    """Return what a job has to know of the run that starts it, and that changes no result.

    ``process`` is its number; ``options`` the Snakefile of a side study, ``--configfile`` and ``--config`` as
    they were given, to be typed again.
    """
    snakefile = os.path.relpath(workflow.main_snakefile)
    files = [os.path.relpath(path) for path in workflow.overwrite_configfiles]
    parts = {"--snakefile": [snakefile] if snakefile != "Snakefile" else []}
    parts |= {"--configfile": files, "--config": list(workflow.config_settings.config_args or ())}
    options = " ".join(shlex.join([name, *values]) for name, values in parts.items() if values)
    return {"process": os.getpid(), "options": options}
