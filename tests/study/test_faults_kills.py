"""Killed at any moment, the study is completed by the next run, with the same results."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import pytest
from study_arrays import assert_equal_results, assert_part_of
from study_copy import StudyCopy

from swesbi.artefacts.files import check_whole

SEED = 20
ONE_SUBJECT = "results-smoke/paper/subjects/A/ppc.png"
MOST_JOBS = 4
LONGEST_S = 3.0
SCRIPT = re.compile(r"scripts/tmp\w+\.stage\.py$")
STARTING = "starting"
WAYS = ("everything", "the run alone", "one job alone")


@dataclass(frozen=True)
class Moment:
    """So long after so many jobs of this run have finished; 0 jobs is the start of the run."""

    jobs: int
    delay_s: float


def jobs_of(run: int) -> dict[int, str]:
    """Return the jobs at work: process -> rule, which is told by the log that the job has opened."""
    found: dict[int, str] = {}
    for child in psutil.Process(run).children(recursive=True):
        try:
            if SCRIPT.search(" ".join(child.cmdline())):
                opened = [Path(file.path).parts for file in child.open_files()]
                found[child.pid] = next(
                    (parts[parts.index("logs") + 1] for parts in opened if "logs" in parts), STARTING
                )
        except psutil.Error:
            continue
    return found


def strike(process: subprocess.Popen[bytes], way: str, rng: np.random.Generator) -> dict[int, str]:
    """Kill with SIGKILL in one of the ways; return the jobs that were at work."""
    jobs = jobs_of(process.pid)
    if way == "everything":
        os.killpg(process.pid, signal.SIGKILL)
    elif way == "one job alone" and jobs:
        os.kill(int(rng.choice(sorted(jobs))), signal.SIGKILL)
    else:
        process.kill()
    return jobs


def wait_for_moment(process: subprocess.Popen[bytes], output: Path, moment: Moment) -> bool:
    """Wait until the moment of the kill; return whether the run is still alive then."""
    while process.poll() is None and output.read_text().count("Finished jobid") < moment.jobs:
        time.sleep(0.05)
    try:
        process.wait(moment.delay_s)
    except subprocess.TimeoutExpired:
        return True
    return False


def run_until_killed(
    study: StudyCopy, targets: tuple[str, ...], moment: Moment, way: str, rng: np.random.Generator
) -> set[str] | None:
    """Run the study and kill it; return the rules at work, or None if it had finished before."""
    output = study.folder / "output.txt"
    with output.open("wb") as file:
        how = {"cwd": study.folder, "env": study.environment, "stdout": file, "stderr": file}
        process = subprocess.Popen(study.command(*targets), start_new_session=True, **how)
    if not wait_for_moment(process, output, moment):
        assert process.returncode == 0, output.read_text()
        return None
    jobs = strike(process, way, rng)
    process.wait()
    left = [psutil.Process(pid) for pid in jobs if psutil.pid_exists(pid)]
    assert not psutil.wait_procs(left, timeout=60)[1], "a job outlived the run that started it"
    return set(jobs.values())


def start_anew(study: StudyCopy) -> None:
    shutil.rmtree(study.results)
    shutil.rmtree(study.folder / ".snakemake")


@pytest.mark.parametrize(
    ("kills", "targets", "least_rules"),
    [
        pytest.param(3, (ONE_SUBJECT,), 1, marks=pytest.mark.slow(minutes=2), id="3 kills, one subject"),
        pytest.param(20, (), 5, marks=pytest.mark.exhaustive, id="20 kills, the whole study"),
    ],
)
def test_the_study_is_completed_after_kills(
    finished: StudyCopy, own_study: StudyCopy, kills: int, targets: tuple[str, ...], least_rules: int
) -> None:
    """Kill one study again and again until it is finished, compare, start anew, until the kills are spent.

    Each kill is followed by a plain run with the same command. After it every artefact that is there is
    whole; a finished study has the arrays and bytes of an undisturbed one. Which job a moment, drawn from a
    seed, hits depends on the machine; a few hit none because the run is just starting.
    """
    rng = np.random.default_rng(SEED)
    assert_same = assert_part_of if targets else assert_equal_results
    study = own_study
    start_anew(study)
    hit: list[set[str]] = []
    completed = 0
    while len(hit) < kills:
        way = WAYS[len(hit) % len(WAYS)]
        moment = Moment(int(rng.integers(0, MOST_JOBS + 1)), float(rng.uniform(0.0, LONGEST_S)))
        rules = run_until_killed(study, targets, moment, way, rng)
        if rules is not None:
            hit.append(rules)
            print(f"kill {len(hit)}: {way}, at work: {', '.join(sorted(rules)) or 'no job yet'}", flush=True)
            for path in study.results.rglob("[!.]*"):
                if path.suffix in {".h5", ".pt"}:
                    check_whole(path)
            continue
        assert_same(study.results, finished.results)
        completed += 1
        start_anew(study)
    study.run(*targets)
    assert assert_same(study.results, finished.results) > 15
    print(f"{len(hit)} kills, {completed + 1} completed studies")
    assert len(set().union(*hit)) >= least_rules, f"the kills have hit {set().union(*hit)} alone"
