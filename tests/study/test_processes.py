"""Work side by side: one killed process costs one item, and none outlives what started it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from swesbi.artefacts import DamagedArtefactError
from swesbi.base.workers import WorkerKilledError, is_alive, side_by_side

THREADS: Final = """
import numpy as np
from swesbi.base.workers import side_by_side

def work(_):
    ones = np.ones((1000, 1000), np.float32)
    return float((ones @ ones).max())

work(0)
print(next(side_by_side(work, [0], 1))[1])
"""
WAITING: Final = """
import os, sys, time
from pathlib import Path
from swesbi.base.workers import side_by_side

def work(name):
    Path(name).write_text(str(os.getpid()))
    try:
        time.sleep(60)
    finally:
        Path(name).unlink()

list(side_by_side(work, sys.argv[1:], 2))
"""


def test_a_worker_ends_after_its_parent_used_threads() -> None:
    surroundings = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    command = [sys.executable, "-c", THREADS]
    done = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 1000.0


def ended_by(number: int) -> int:
    """Return the number doubled; negative ones are the signal that ends this process."""
    if number < 0:
        os.kill(os.getpid(), -number)
    return 2 * number


@pytest.mark.parametrize("workers", [1, 3])
def test_a_killed_worker_costs_its_own_item_alone(workers: int) -> None:
    numbers = [1, -signal.SIGKILL, 2, -signal.SIGUSR1, 3, -signal.SIGTERM, 4]
    found = dict(side_by_side(ended_by, numbers, workers))
    said = {number: str(found.pop(number)) for number in numbers if number < 0}
    assert found == {1: 2, 2: 4, 3: 6, 4: 8}
    assert "killed (SIGKILL), probably because the memory ran out" in said[-signal.SIGKILL]
    assert "killed (SIGTERM)" in said[-signal.SIGTERM]
    assert "crashed (SIGUSR1)" in said[-signal.SIGUSR1]


def damaged(name: str) -> None:
    raise DamagedArtefactError(Path(name), "was cut off")


def test_an_error_of_the_work_is_raised_as_it_is() -> None:
    with pytest.raises(DamagedArtefactError, match=r"a\.h5: was cut off; delete it") as caught:
        list(side_by_side(damaged, ["a.h5"], 1))
    assert caught.value.fault == "was cut off"
    assert "in damaged" in caught.value.__notes__[0]


def test_workers_end_when_no_more_is_wanted() -> None:
    work = side_by_side(lambda _: os.getpid(), range(8), 2)
    processes = {next(work)[1] for _ in range(4)}
    work.close()
    assert not any(is_alive(process) for process in processes if not isinstance(process, WorkerKilledError))


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_soon_after_what_started_them(tmp_path: Path, how: signal.Signals) -> None:
    """It is not waited for, as by a shell that waits for something else: it stays a zombie."""
    files = [tmp_path / "a", tmp_path / "b"]
    parent = subprocess.Popen([sys.executable, "-c", WAITING, *map(str, files)])
    try:
        within(10, lambda: all(file.is_file() and file.read_text() for file in files))
        workers = [int(file.read_text()) for file in files]
        parent.send_signal(how)
        within(5, lambda: not any(map(runs, workers)))
    finally:
        parent.kill()
        parent.wait()


def within(seconds: float, happens: Callable[[], bool]) -> None:
    until = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < until
        time.sleep(0.05)


def runs(process: int) -> bool:
    """Tell whether a process does anything yet; who has taken it on may not have noticed its end."""
    state = Path("/proc", str(process), "stat")
    return state.is_file() and state.read_text().rsplit(")", 1)[1].split()[0] != "Z"
