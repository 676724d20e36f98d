"""Snakemake's own lint of the workflow, its only script, and its profile for a cluster."""

from __future__ import annotations

import re
import subprocess
import sys

import yaml
from study_copy import ROOT

# The project's own virtual environment holds what every rule needs; an untested container would promise more.
ACCEPTED = {"Specify a conda environment or container for each rule."}
LARGEST_MB = 4096


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


def test_the_profile_names_rules_that_exist_and_asks_for_more_than_the_rest_but_no_whole_node() -> None:
    text = (ROOT / "profiles" / "slurm" / "config.yaml").read_text(encoding="utf-8")
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    rules = set(re.findall(r"^ *rule (\w+):", "\n".join(texts), re.MULTILINE))
    content = yaml.safe_load(text)
    assert {*content["set-resources"], *content["groups"]} <= rules
    assert set(content["group-components"]) <= set(content["groups"].values())
    default = content["default-resources"]["mem_mb"]
    assert all(default < asked["mem_mb"] <= LARGEST_MB for asked in content["set-resources"].values())
