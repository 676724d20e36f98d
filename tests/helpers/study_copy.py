"""A copy of the project to run the smoke study in, to edit, and to ask what would rerun."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PARTS = ("Snakefile", "config.yaml", "config", "profiles", "workflow", "src", "data")
RESULTS = "results-smoke"
OF_OTHERS = shutil.ignore_patterns("explorer.*", "studies")  # results of packages that a copy does not have
KNOWN = ".snakemake/metadata"  # what Snakemake knows of results: the inputs, params and code that made them
COMPILED = {".pyc", ".nbi", ".nbc"}  # valid wherever the source has the same time


class Job(NamedTuple):
    """A job that would run, by its rule and one of its outputs."""

    rule: str
    output: str

    def is_of(self, subject: str) -> bool:
        """Tell whether the output is one subject's."""
        return f"/{subject}/" in self.output or self.output.endswith(f"/{subject}.h5")


@dataclass(frozen=True)
class StudyCopy:
    """The project's files in a folder of their own; ``config`` is merged over config.yaml."""

    folder: Path
    config: str = "smoke.yaml"

    @property
    def results(self) -> Path:
        return self.folder / RESULTS

    def snakemake(self, *arguments: str, cores: int = 2) -> subprocess.CompletedProcess[str]:
        """Run Snakemake in the copy, with the copy's own package."""
        return self.call(*self.command(*arguments, cores=cores)[1:])

    def command(self, *arguments: str, cores: int = 2) -> list[str]:
        """Return the command that runs Snakemake."""
        snakemake = [sys.executable, "-m", "snakemake", "--cores", str(cores)]
        return [*snakemake, *arguments, "--configfile", self.config]

    def call(self, *arguments: str, timeout_s: float | None = None) -> subprocess.CompletedProcess[str]:
        """Run Python in the copy, with the copy's own package; what it says is kept."""
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )

    @property
    def environment(self) -> dict[str, str]:
        """The environment in which the copy's own package is used, and ``snakemake`` is on the path."""
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        return {**os.environ, "PATH": path, "PYTHONPATH": str(self.folder / "src"), "NO_COLOR": "1"}

    def run(self, *arguments: str, cores: int = 2) -> None:
        """Run Snakemake and fail with its output unless it succeeds."""
        done = self.snakemake(*arguments, cores=cores)
        assert done.returncode == 0, done.stdout + done.stderr

    def planned(self, *targets: str) -> set[Job]:
        """Return the jobs that would run, one for each output that they would write."""
        done = self.snakemake("--summary", *targets)
        assert done.returncode == 0, done.stdout + done.stderr
        rows = [line.split("\t") for line in done.stdout.splitlines()]
        header = rows[0]
        rule, path, plan = (header.index(name) for name in ("rule", "output_file", "plan"))
        return {Job(row[rule], row[path]) for row in rows[1:] if row[plan] == "update pending"}

    def edit(self, path: str, old: str, new: str) -> None:
        """Replace text that occurs once in a file of the copy."""
        file = self.folder / path
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{path} holds {old!r} {text.count(old)} times"
        file.write_text(text.replace(old, new), encoding="utf-8")


def without_home(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a service's account, whose home does not exist: nobody makes one in /proc."""
    kept = {name: value for name, value in environment.items() if not name.startswith(("XDG_", "MPLCONFIG"))}
    return {**kept, "HOME": "/proc/nowhere"}


def copy_study(folder: Path) -> StudyCopy:
    """Copy the project with its compiled code, without its results, into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    for part in PARTS:
        if (ROOT / part).is_dir():
            copy_tree(ROOT / part, folder / part)
        else:
            shutil.copy2(ROOT / part, folder / part)
    shutil.copy2(ROOT / "tests" / "smoke.yaml", folder / "smoke.yaml")
    return StudyCopy(folder)


def run_side_study(study: StudyCopy, name: str, *rules: str) -> Path:
    """Run a side study in its small sizes on a finished copy, where a second run finds nothing to do."""
    copy_tree(ROOT / "studies", study.folder / "studies")  # one side study may take code of another
    snakemake = ("-m", "snakemake", "--snakefile", f"studies/{name}/Snakefile", "--cores", "2")
    given = ("--configfile", study.config, f"studies/{name}/small.yaml")
    for expected in ("", "Nothing to be done"):
        done = study.call(*snakemake, *given, "--", *rules)
        assert done.returncode == 0, done.stdout + done.stderr
        assert expected in done.stdout + done.stderr
    return study.results / "studies" / name


def adopt_results(study: StudyCopy) -> None:
    """Give a copy the results of ``make smoke`` in the project, where there are any, current or not."""
    if (ROOT / RESULTS).is_dir():
        shutil.copytree(ROOT / RESULTS, study.results, ignore=OF_OTHERS)
    if (ROOT / KNOWN).is_dir():
        copy_tree(ROOT / KNOWN, study.folder / KNOWN)


def duplicate(study: StudyCopy, folder: Path) -> StudyCopy:
    """Copy a study with its results, its compiled code and what Snakemake knows of it."""
    copy_tree(study.folder, folder)
    return StudyCopy(folder, study.config)


def copy_tree(source: Path, target: Path) -> None:
    """Copy a folder with the times of its files, which tell Snakemake and Numba what is current."""
    shutil.copytree(source, target, ignore=_passing)


def _passing(folder: str, names: list[str]) -> set[str]:
    """Return what another process may be writing at this moment, and what installing leaves."""
    if Path(folder).name == "__pycache__":
        return {name for name in names if Path(name).suffix not in COMPILED}
    return {name for name in names if name.endswith(".egg-info")}


def rules_of(jobs: set[Job]) -> set[str]:
    """Return the names of the rules among planned jobs."""
    return {job.rule for job in jobs}


def of_rule(jobs: set[Job], rule: str) -> set[Job]:
    """Return the planned jobs of one rule; at least one is expected."""
    found = {job for job in jobs if job.rule == rule}
    assert found, f"no job of {rule} among {jobs}"
    return found
