"""Machines that people have: groups that share a folder, other shells, folders with any name."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from study_copy import ROOT, copy_study

from swesbi.artefacts import write_json


@pytest.mark.parametrize(("umask", "mode"), [(0o077, 0o600), (0o022, 0o644), (0o002, 0o664)])
def test_files_have_the_permissions_that_the_umask_leaves(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        write_json(tmp_path / "support.json", {})
    finally:
        os.umask(before)
    assert (tmp_path / "support.json").stat().st_mode & 0o777 == mode


def test_the_backend_of_the_callers_shell_stops_no_command(tmp_path: Path) -> None:
    other = {**os.environ, "MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    sheets = ["--plot", str(tmp_path / "sheets")]
    command = [
        sys.executable,
        "-m",
        "swesbi",
        "validate",
        str(ROOT / "data" / "virtual_push_trains"),
        *sheets,
    ]
    done = subprocess.run(command, env=other, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "sheets" / "A.png").is_file()


@pytest.mark.slow(minutes=0.5)
def test_the_study_runs_in_a_folder_of_any_name(tmp_path: Path) -> None:
    """The environment lies in it: its Python has blanks, a quote and signs of the shell in its path."""
    study = copy_study(tmp_path / "Müller's a [b] & R")
    (study.folder / ".venv").symlink_to(Path(sys.prefix))
    command = [str(study.folder / ".venv" / "bin" / "python"), "-m", "snakemake", "--cores", "1"]
    target = ["--configfile", "smoke.yaml", "--", "results-smoke/cohort/A/passive.h5"]
    environment = {**os.environ, "PYTHONPATH": str(study.folder / "src")}
    done = subprocess.run(
        [*command, *target], cwd=study.folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (study.folder / "results-smoke" / "cohort" / "A" / "passive.h5").is_file()
    script = study.folder / "workflow" / "scripts" / "stage.py"
    script.touch()
    again = subprocess.run(
        [*command, "--dry-run", *target],
        cwd=study.folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "Nothing to be done" in again.stdout + again.stderr
