"""A job ends with the run that started it."""

from __future__ import annotations

import os
import threading
import time
from typing import Final

from swesbi.artefacts.atomic import is_alive

POLL_S: Final = 0.2
EXIT_ORPHAN: Final = 3
RUN: Final = "current_run"
"""Key of the workflow's ``config`` that is no part of the study: process and options of the run."""


def end_with(run: int) -> None:
    """End this process at once, from now on, when the process with this number is gone.

    A job that outlives a killed run would write its result later, beside or over that of the next run,
    which may have other settings by then.
    """
    threading.Thread(target=_watch, args=(run,), daemon=True, name="run").start()


def _watch(run: int) -> None:
    while is_alive(run):
        time.sleep(POLL_S)
    # not sys.exit, which ends the thread alone: nothing of this process is wanted any more
    os._exit(EXIT_ORPHAN)
