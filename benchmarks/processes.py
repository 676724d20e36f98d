"""What a command costs: time and memory of a process."""

from __future__ import annotations

import os
import re
import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
POLL_S: Final = 0.5


@dataclass(frozen=True)
class Run:
    """One process and those it started; memory is its own peak, without those that it started."""

    output: str
    wall_s: float
    cpu_s: float
    memory_mb: float


def run(command: Sequence[str]) -> Run:
    """Run a command in the project's folder; a RuntimeError says that it failed."""
    start, peaks = time.perf_counter(), [0.0]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        watch = threading.Thread(target=_watch, args=(process.pid, peaks), daemon=True)
        watch.start()
        output = process.stdout.read() if process.stdout else ""
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{output[-4000:]}")
    return Run(output, time.perf_counter() - start, used.ru_utime + used.ru_stime, peaks[0])


def _watch(process: int, peaks: list[float]) -> None:
    """Follow the peak memory (MB) of a process until it ends."""
    status = Path(f"/proc/{process}/status")
    while True:
        try:
            found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text(encoding="utf-8"))
        except OSError:
            return
        if found is None:
            return
        peaks[0] = float(found[1]) / 1024.0
        time.sleep(POLL_S)
