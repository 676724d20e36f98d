"""The study from another workflow, by `module swesbi`, and from the place that catalogues expect."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import guard
import pytest
from study_copy import RESULTS, StudyCopy, copy_study

OTHER = """
configfile: "smoke.yaml"


module swesbi:
    snakefile:
        "{study}/Snakefile"
    config:
        config


use rule * from swesbi
"""


def importing(folder: Path, study: StudyCopy) -> Path:
    """Another workflow, which has nothing of the study but a configuration."""
    folder.mkdir()
    (folder / "Snakefile").write_text(OTHER.format(study=study.folder), encoding="utf-8")
    shutil.copy2(study.folder / study.config, folder)
    return folder


def snakemake(folder: Path, study: StudyCopy, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--cores", "2", *arguments],
        cwd=folder, env=study.environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_another_workflow_and_the_catalogue_plan_the_same_outputs(tmp_path: Path) -> None:
    study = copy_study(tmp_path / "study")
    other = importing(tmp_path / "other", study)
    summaries = (
        snakemake(other, study, "--summary"),
        snakemake(study.folder, study, "--summary", "--configfile", study.config, "-s", "workflow/Snakefile"),
    )
    planned = {job.output for job in study.planned()}
    assert len(planned) > 100
    for summary in summaries:
        assert {line.split("\t")[0] for line in summary.splitlines()[1:]} == planned


@pytest.mark.slow(minutes=4)
def test_another_workflow_makes_the_same_bytes(finished: StudyCopy, tmp_path: Path) -> None:
    other = importing(tmp_path / "other", finished)
    snakemake(other, finished)
    found = guard.differences(guard.hashes(finished.results), guard.hashes(other / RESULTS))
    assert not any(found.values()), found
