"""A copy of the project to run the smoke study in, to edit, and to ask what would rerun."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PARTS = ("Snakefile", "config.yaml", "workflow", "src", "data")
JOB = re.compile(r"^(?:local)?rule (\w+):\n((?:    .*\n)*)", re.MULTILINE)
WILDCARDS = re.compile(r"^    wildcards: (.*)$", re.MULTILINE)


@dataclass(frozen=True)
class StudyCopy:
    """The project's files in a folder of their own; ``config`` is merged over config.yaml."""

    folder: Path
    config: str = "smoke.yaml"

    @property
    def results(self) -> Path:
        return self.folder / "results-smoke"

    def snakemake(self, *arguments: str, cores: int = 2) -> subprocess.CompletedProcess[str]:
        """Run Snakemake in the copy, with the copy's own package."""
        command = [
            sys.executable,
            "-m",
            "snakemake",
            "--cores",
            str(cores),
            "--configfile",
            self.config,
            *arguments,
        ]
        environment = {**os.environ, "PYTHONPATH": str(self.folder / "src"), "NO_COLOR": "1"}
        return subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )

    def run(self, *arguments: str, cores: int = 2) -> None:
        """Run Snakemake and fail with its output unless it succeeds."""
        done = self.snakemake(*arguments, cores=cores)
        assert done.returncode == 0, done.stdout + done.stderr

    def planned(self, *targets: str) -> set[str]:
        """Return the jobs that a dry run lists, as ``rule`` or ``rule wildcard=value, ...``."""
        done = self.snakemake("--dry-run", *targets)
        output = done.stdout + done.stderr
        assert done.returncode == 0, output
        jobs = set()
        for rule, body in JOB.findall(output):
            wildcards = WILDCARDS.search(body)
            jobs.add(f"{rule} {wildcards[1]}" if wildcards else rule)
        return jobs - {"all"}

    def edit(self, path: str, old: str, new: str) -> None:
        """Replace text that occurs once in a file of the copy."""
        file = self.folder / path
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{path} holds {old!r} {text.count(old)} times"
        file.write_text(text.replace(old, new), encoding="utf-8")


def copy_study(folder: Path) -> StudyCopy:
    """Copy the project, without its results, into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy2(source, folder / part)
    shutil.copy2(ROOT / "tests" / "smoke.yaml", folder / "smoke.yaml")
    return StudyCopy(folder)


def rules_of(jobs: set[str]) -> set[str]:
    """Return the names of the rules among planned jobs."""
    return {job.split(" ")[0] for job in jobs}
