from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS, prior_draws

from swesbi.base.arrays import BoolArray
from swesbi.base.terminal import InterruptedBySignal, ended_by_signals
from swesbi.base.workers import LIMIT, in_threads, side_by_side, usable
from swesbi.heart import periodic
from swesbi.heart.periodic import Status
from swesbi.heart.physiology import RANGES, Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate

HURRIED = SETTINGS.model_copy(update={"maximum_beats": 4})
STRONG = SETTINGS.model_copy(update={"maximum_beats": 5, "sigma_0_pa": 1.5e6})
THETA = prior_draws(300, seed=11)
JOB = """
rule all:
    output: "threads.txt"
    script: "job.py"
"""
SCRIPT = """
from pathlib import Path
from swesbi.base.workers import usable
Path(snakemake.output[0]).write_text(str(usable()))
"""


def walls_of_all_kinds() -> Physiology:
    """Return hearts that differ in their passive wall, as widely as is declared."""
    factors = np.geomspace(*RANGES["passive_wall_factor"], len(THETA))
    return replace(Physiology.of_settings(SETTINGS, len(THETA)), passive_wall_factor=factors)


def simulated(
    threads: int,
    monkeypatch: pytest.MonkeyPatch,
    settings: ForwardModelSettings = HURRIED,
    physiology: Physiology | None = None,
) -> Beats:
    """Return the beats, after seeing that other threads ran them only where these are allowed."""
    ran: set[threading.Thread] = set()
    settled = periodic._settled

    def noted(*given: Any) -> BoolArray:  # noqa: ANN401
        ran.add(threading.current_thread())
        return settled(*given)

    with monkeypatch.context() as patch:
        patch.setenv(LIMIT, str(threads))
        patch.setattr(periodic, "_settled", noted)
        beats = simulate(THETA, COHORT["B"], settings, physiology)
    assert (ran == {threading.current_thread()}) == (threads == 1)
    return beats


@pytest.mark.parametrize(
    ("settings", "physiology"),
    [(STRONG, None), (HURRIED, walls_of_all_kinds())],
    ids=["walls too strong for any step", "physiology by simulation"],
)
def test_every_number_of_threads_gives_the_same_bits(
    settings: ForwardModelSettings, physiology: Physiology | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = simulated(1, monkeypatch, settings, physiology)
    failures = {Status.NOT_PERIODIC, *([Status.NON_FINITE] if settings is STRONG else [])}
    assert {Status.PERIODIC, *failures} <= set(one.status)
    for threads in (2, 3):
        several = simulated(threads, monkeypatch, settings, physiology)
        for field in fields(Beats):
            np.testing.assert_array_equal(getattr(several, field.name), getattr(one, field.name))


def test_the_first_error_in_the_order_of_the_items_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT, "3")
    second_failed = threading.Event()

    def work(item: int) -> None:
        if item == 0:
            second_failed.wait(10)
        else:
            second_failed.set()
        raise ArithmeticError(item)

    with pytest.raises(ArithmeticError, match="0"):
        in_threads(work, range(5))


def test_how_numpy_warns_is_that_of_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT, "2")
    zeros = np.zeros(2)
    with np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        in_threads(lambda item: np.divide(1.0, zeros), [0, 1])


@pytest.mark.parametrize("at", [0, 4], ids=["as the threads start", "while they run"])
def test_ctrl_c_ends_the_threads_and_begins_nothing_more(at: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT, "2")
    before, begun = set(threading.enumerate()), []

    def work(item: int) -> None:
        begun.append(item)
        if item == at:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.05)

    with pytest.raises(InterruptedBySignal), ended_by_signals():
        in_threads(work, range(100))
    for thread in set(threading.enumerate()) - before:  # one may be in the midst of its start
        thread.join(5)
        assert not thread.is_alive()
    assert len(begun) < 50  # of 100, also on a machine that is slow to notice


def test_workers_have_one_thread_and_are_forked_beside_none(monkeypatch: pytest.MonkeyPatch) -> None:
    before, fork, beside = set(threading.enumerate()), os.fork, []

    def noted() -> int:
        beside.append(set(threading.enumerate()) - before)
        return fork()

    monkeypatch.setattr(os, "fork", noted)
    simulated(3, monkeypatch)
    monkeypatch.delenv(LIMIT, raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(5))
    assert usable() == 5
    assert dict(side_by_side(lambda _: usable(), ["a", "b"], 2)) == {"a": 1, "b": 1}
    assert beside == [set(), set()]


def test_a_job_of_snakemake_has_one_thread(tmp_path: Path) -> None:
    (tmp_path / "Snakefile").write_text(JOB)
    (tmp_path / "job.py").write_text(SCRIPT)
    surroundings = {name: value for name, value in os.environ.items() if name != LIMIT}
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--quiet"]
    done = subprocess.run(
        command, cwd=tmp_path, env=surroundings, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "threads.txt").read_text() == "1"


def test_macos_which_binds_no_process_to_processors_has_all_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(LIMIT, raising=False)
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert usable() == os.cpu_count()


@pytest.mark.parametrize("stated", ["0", "many", "-2"])
def test_a_limit_that_is_no_number_of_threads_is_refused(
    stated: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(LIMIT, stated)
    with pytest.raises(ValueError, match=f"{LIMIT} = '{stated}'"):
        usable()
