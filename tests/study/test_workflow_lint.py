"""Snakemake's own lint of the workflow."""

from __future__ import annotations

import re
import subprocess
import sys

from study_copy import ROOT

# The project's own virtual environment holds what every rule needs; an untested container would promise more.
ACCEPTED = {"Specify a conda environment or container for each rule."}


def test_lint_finds_nothing_but_what_is_accepted() -> None:
    command = [sys.executable, "-m", "snakemake", "--lint"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    lints = re.findall(r"^ {4}\* (.*):$", done.stdout + done.stderr, re.MULTILINE)
    assert len(lints) > 10
    assert set(lints) == ACCEPTED


def test_scripts_hold_no_science() -> None:
    scripts = [path for path in (ROOT / "workflow" / "scripts").rglob("*") if path.is_file()]
    assert scripts == [ROOT / "workflow" / "scripts" / "stage.py"]
    assert len(scripts[0].read_text(encoding="utf-8").splitlines()) <= 10
