"""The walk through the virtual trial does what its page says, command by command, on a small study."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy

from swesbi.change.ratios import QUANTITIES

PAGE = (ROOT / "docs" / "change-and-groups.md").read_text(encoding="utf-8")
BINARIES = Path(sys.executable).parent
PERSONS = ["P01", "P02", "P05", "P06"]  # two of each group: the page's 24 take an hour


def walk() -> list[str]:
    """The commands of the page's first block."""
    block = re.search(r"^```\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert block
    return block[1].splitlines()


def typed(command: str, study: StudyCopy) -> str:
    """Run a command of the page in the copy, and return what it printed."""
    done = subprocess.run(
        ["bash", "-c", command.replace(".venv/bin", shlex.quote(str(BINARIES)))],
        cwd=study.folder,
        env={**os.environ, "PYTHONPATH": str(study.folder / "src"), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.slow(minutes=5)
def test_the_walk_through_the_virtual_trial(own_study: StudyCopy) -> None:
    study = own_study
    subjects = study.folder / "data" / "virtual_trial" / "subjects.csv"
    table = pd.read_csv(subjects)
    table[table["person"].isin(PERSONS)].to_csv(subjects, index=False)
    study.edit("smoke.yaml", "\ncmaes:\n", "\nrun: [amortised]\ncmaes:\n")  # one of two, at half the price
    overlay, validate, change, changes = walk()
    typed(overlay, study)
    assert "8 recordings can be used" in typed(validate, study)
    # the page's network is that of the full study; this one is the small study's
    assert typed(f"{change} --overlay {study.config}", study).startswith("P01: ")
    typed(changes.replace("--configfile ", f"--configfile {study.config} "), study)
    found = pd.read_csv(study.results / "tables" / "changes.csv")
    assert set(found["experiment"]) == {"amortised"}
    assert sorted(found["person"].unique()) == PERSONS
    assert len(found) == len(PERSONS) * len(QUANTITIES)
    groups = pd.read_csv(study.results / "tables" / "changes_groups.csv")
    assert {"treated", "control"} <= set(groups["of"])
