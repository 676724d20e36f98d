"""The small study through a real Slurm of one node gives the arrays of a run on this machine."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from study_arrays import assert_equal_results, assert_part_of
from study_copy import ROOT, StudyCopy, copy_study

SCRIPT = ROOT / "tests" / "helpers" / "cluster" / "slurm.sh"
PROFILE = "profiles/slurm"
DAEMONS = ("slurmctld", "slurmd", "munged", "sbatch", "squeue")
# This Slurm has no accounts and keeps none of jobs; it has two processors, and one disk. The plugin waits ten
# seconds longer after each look at which no job had ended; a job of a smoke study takes seconds.
HERE = ["--slurm-status-command", "squeue", "--slurm-no-account", "--latency-wait", "5"]
HERE += ["--slurm-init-seconds-before-status-checks", "1"]
TIMEOUT_S = 2700
SAMPLE = tuple(
    f"results-smoke/{name}"
    for name in ("cohort/A/passive.h5", "cohort/noise.h5", "simulations/calibrated/A/shard-0.h5")
)


def why_not() -> str:
    """Return why Slurm cannot run here; empty if it can."""
    if missing := [name for name in DAEMONS if not shutil.which(name)]:
        return f"no {missing[0]}: apt-get install slurmctld slurmd slurm-client munge"
    if importlib.util.find_spec("snakemake_executor_plugin_slurm") is None:
        return "Snakemake's plugin is missing: make cluster"
    if os.geteuid() != 0:
        return "the daemons of Slurm start as root only"
    system = Path("/etc/slurm/slurm.conf")
    if system.exists() and system.resolve().name != "swesbi-test-slurm.conf":  # of a test that was killed
        return "this machine has a Slurm of its own"
    return ""


@pytest.fixture
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A Slurm of this machine's processors, on the loopback interface."""
    folder = tmp_path_factory.mktemp("slurm")
    for parent in (folder, *folder.parents[:2]):
        parent.chmod(0o755)  # the socket of munge must not lie where others could not go
    subprocess.run([SCRIPT, "start", folder], check=True, timeout=120)
    yield
    subprocess.run([SCRIPT, "stop", folder], check=True, timeout=60)


@pytest.mark.parametrize(
    ("targets", "least_results"),
    [
        pytest.param(SAMPLE, len(SAMPLE), marks=pytest.mark.slow, id="some jobs"),
        pytest.param((), 30, marks=pytest.mark.exhaustive, id="the whole study"),
    ],
)
@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_the_small_study_runs_through_slurm_and_gives_the_same_arrays(
    finished: StudyCopy, slurm: None, tmp_path: Path, targets: tuple[str, ...], least_results: int
) -> None:
    study = copy_study(tmp_path)
    command = ["-m", "snakemake", "--profile", PROFILE, *HERE, "--configfile", study.config]
    done = study.call(*command, "--", *targets, timeout_s=TIMEOUT_S)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "has been submitted with SLURM jobid" in done.stdout + done.stderr
    assert_same = assert_part_of if targets else assert_equal_results
    assert assert_same(study.results, finished.results) >= least_results
