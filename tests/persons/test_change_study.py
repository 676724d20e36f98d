"""The walk through the virtual trial, and the commands `compare` and `plan`, on a finished small study."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import yaml
from study_copy import ROOT, StudyCopy, without_home

from swesbi.__main__ import main
from swesbi.answers.change import OUTPUTS
from swesbi.config.read import overlay, read_yaml
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.study.compare import ALL_CHANGES, GROUP_OUTPUTS

PAGE = (ROOT / "docs" / "compare-and-plan.md").read_text(encoding="utf-8")
BINARIES = Path(sys.executable).parent
TRIAL = Path("data") / "virtual_trial"
PAIR = ("P02-before", "P02-after")
CAME = [*(f"P02-{visit}" for visit in ("before", "between", "after")), "P06-before", "P06-after"]
ASIDE = ["P01-before", "P01-after", "P05-before"]
"""Of the page's 24 persons, who take an hour, two are answered, one is refused, and one came once."""
REFUSED_CM = 2.2
SHORT = {"mcmc": {"steps": 10, "max_steps": 10}}
"""A sampler that is not to converge."""
STAY = ("observation.h5", "posterior.h5", "verdict.json", "predictive.h5")
"""What the answer to one visit has that no clock and no place is in."""


def typed(command: str, study: StudyCopy, code: int = 0) -> str:
    """Run a command of the page in the copy, see that it ends with this code, and return what it printed."""
    done = subprocess.run(
        ["bash", "-c", command.replace(".venv/bin", shlex.quote(str(BINARIES)))],
        cwd=study.folder,
        env=without_home(study.environment),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, f"{command}\n{done.stdout}{done.stderr}"
    assert "Warning" not in done.stderr
    assert "matplotlib" not in done.stderr
    return done.stdout


def shorten(study: StudyCopy) -> None:
    """Let one experiment of the copy run, and samplers be short."""
    small = {
        "run": ["amortised"],
        "changes": {"exact": SHORT},
        "experiments": {"calibrated": {"exact": SHORT}},
    }
    path = study.folder / study.config
    path.write_text(yaml.safe_dump(overlay(read_yaml(path), small)), encoding="utf-8")


def leave_few(cohort: Path) -> None:
    """Leave few persons of the trial: the first comes three times, and no network knows another's heart."""
    table = pd.read_csv(cohort / "subjects.csv").set_index("subject", drop=False)
    between = table.loc[[PAIR[0]]].assign(subject=CAME[1], visit="between")
    few = pd.concat([table, between.set_index("subject", drop=False)]).loc[CAME + ASIDE]
    few.loc[few["person"] == "P01", "ivsd_cm"] = REFUSED_CM
    few.to_csv(cohort / "subjects.csv", index=False)
    again = pd.read_csv(cohort / "swe" / f"{PAIR[0]}.csv")
    again["shear_wave_speed_m_s"] = (1.02 * again["shear_wave_speed_m_s"]).round(3)  # a copy is refused
    again.to_csv(cohort / "swe" / f"{CAME[1]}.csv", index=False)


@pytest.mark.slow(minutes=3)
def test_the_walk_through_the_virtual_trial(own_study: StudyCopy, tmp_path: Path) -> None:
    """The commands of the page in its order; a person has the same answer alone and among all."""
    study = own_study
    shorten(study)
    study.run("results-smoke/amortised/flow.h5")
    leave_few(study.folder / TRIAL)
    validate, change, everyone = re.findall(r"^\S+/swesbi (?:validate|compare) .*$", PAGE, re.MULTILINE)
    assert "8 recordings can be used" in typed(validate, study)
    # the page's network is that of the full study; this one is the small study's
    assert typed(f"{change} --overlay {study.config}", study).startswith("P02: before to after\n")
    made, alone = study.results / "amortised" / "change" / "P02", tmp_path / "alone"
    made.rename(alone)
    assert {path.name for path in alone.iterdir()} == {*OUTPUTS, *PAIR}
    said = typed(f"{everyone} --overlay {study.config}", study, code=2)
    assert "2 compared, 1 refused" in said
    # what no clock is in is the same in both folders of P02
    for name in ("change.h5", "change.csv", *(f"{visit}/{file}" for visit in PAIR for file in STAY)):
        assert (made / name).read_bytes() == (alone / name).read_bytes(), name
    assert all((made.parent / name).is_file() for name in (ALL_CHANGES, *GROUP_OUTPUTS))
    found = StoredChange.read(made / "change.h5")
    assert (found.visit, tuple(found.subject)) == (("before", "after"), PAIR)
    assert CohortPosterior.read(made.parent / GROUP_OUTPUTS[0]).member == ("P02", "P06")


@pytest.mark.slow(minutes=2)
def test_a_study_is_planned_and_its_persons_are_kept(
    own_study: StudyCopy, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(own_study.folder)
    shorten(own_study)
    given = f"--overlay {own_study.config} --effect k_sr=-20% --bank 4"

    def plan(further: str) -> str:
        assert main(["plan", *f"{given} {further}".split()]) == 0
        return capsys.readouterr().out

    said = plan("--persons 8")
    assert said.startswith("k_SR -20 %, paired, repeats with errors of 3.0%:")
    assert "This assumes:" in said
    folder = own_study.results / "amortised" / "plan"
    table = pd.read_csv(folder / "paired-k_sr_per_s-20" / "plan.csv")
    assert list(table["persons"]) == [4, 8, 16]
    assert table["power_1"].between(0.0, 1.0).all()
    (bank,) = (folder / "banks").iterdir()
    kept, written = bank.read_bytes(), bank.stat().st_mtime_ns
    assert typed(f".venv/bin/swesbi plan {given} --persons 8", own_study) == said
    assert (bank.read_bytes(), bank.stat().st_mtime_ns) == (kept, written)
    assert "persons in each of two groups" in plan("--design groups --repeats 2,3")
