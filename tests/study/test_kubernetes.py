"""The study on Kubernetes: the plan, and jobs of it through a stand-in for a cluster."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cluster.kubernetes import cluster
from study_arrays import arrays
from study_copy import ROOT, StudyCopy, copy_study

PROFILE = "workflow/profiles/kubernetes"
PLUGINS = ("snakemake_executor_plugin_kubernetes", "snakemake_storage_plugin_fs")
TARGETS = ("cohort/A/passive.h5", "cohort/noise.h5", "simulations/calibrated/A/shard-0.h5")
TIMEOUT_S = 600


def why_not() -> str:
    """Return why Snakemake cannot plan for Kubernetes here; empty if it can."""
    if not all(importlib.util.find_spec(name) for name in PLUGINS):
        return "Snakemake's plugins are missing: make cluster"
    if not shutil.which("rsync"):
        return "no rsync, with which files come from and go to the volume: apt-get install rsync"
    return ""


def snakemake(study: StudyCopy, volume: Path, *arguments: str) -> list[str]:
    """Return the arguments that run a study whose volume is a folder, which holds its recordings."""
    shutil.copytree(study.folder / "data", volume / "data")
    stored = ["--default-storage-prefix", str(volume), "--kubernetes-persistent-volumes", f"swesbi:{volume}"]
    command = ["-m", "snakemake", "--profile", PROFILE, *stored, "--container-image", "swesbi"]
    return [*command, "--configfile", study.config, *arguments]


def total(said: str) -> int:
    """Return the number of jobs that a dry run lists."""
    found = re.search(r"^total +(\d+)$", said, re.MULTILINE)
    assert found, said
    return int(found[1])


@pytest.mark.slow
@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_the_whole_study_is_planned_for_kubernetes(tmp_path: Path) -> None:
    study = copy_study(tmp_path / "study")
    done = study.call(*snakemake(study, tmp_path / "volume", "--dry-run"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert total(done.stdout + done.stderr) == total(study.snakemake("--dry-run").stdout) > 50


@pytest.mark.parametrize(
    ("names", "containers"),
    [
        pytest.param(TARGETS[:1], 1, marks=pytest.mark.slow, id="one pod"),
        # three recordings and a baseline share a pod, then the noise; the simulations are one more
        pytest.param(TARGETS, 3, marks=pytest.mark.exhaustive, id="three pods"),
    ],
)
@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_what_pods_are_told_gives_the_arrays_of_a_run_on_this_machine(
    finished: StudyCopy,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    names: tuple[str, ...],
    containers: int,
) -> None:
    study = copy_study(tmp_path / "study")
    # pods are given what git holds
    shutil.copy2(ROOT / ".gitignore", study.folder)
    for command in (["init", "--quiet"], ["add", "--all"]):
        subprocess.run(["git", *command], cwd=study.folder, check=True)
    volume = tmp_path / "volume"
    targets = [f"{study.results.name}/{name}" for name in names]
    faster = ["--seconds-between-status-checks", "2"]
    with cluster(tmp_path) as (pods, configuration):
        monkeypatch.setenv("KUBECONFIG", str(configuration))
        command = snakemake(study, volume, *faster, "--", *targets)
        done = study.call(*command, timeout_s=TIMEOUT_S)
        assert done.returncode == 0, done.stdout + done.stderr + pods.logs()
    assert len(pods.containers) == containers
    for container in pods.containers.values():
        assert container["image"] == "swesbi"
        assert {"name": "swesbi", "mountPath": str(volume)} in container["volumeMounts"]
        assert int(container["resources"]["requests"]["memory"].removesuffix("M")) >= 1200
    for target in names:
        made = arrays(volume / study.results.name / target)
        for name, array in arrays(finished.results / target).items():
            np.testing.assert_array_equal(made[name], array, err_msg=f"{target}: {name}")
