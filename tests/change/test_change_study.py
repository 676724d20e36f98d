"""The command `change` and the target `changes` on a finished small study: both answer, and alike."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from study_copy import StudyCopy

from swesbi.change.ratios import QUANTITIES
from swesbi.change.stored import read_change
from swesbi.study.change import CHANGE_OUTPUTS

RECORDINGS = {"first": "C", "second": "C", "other": "D"}
"""Visits by the volunteer whose recording each is: two of one person, one of another."""


def write_visits(folder: Path, study: StudyCopy) -> Path:
    """A cohort of one person with three visits, recordings of volunteers that the study leaves aside."""
    shipped = study.folder / "data" / "virtual_volunteers"
    (folder / "swe").mkdir(parents=True)
    (folder / "recording.yaml").write_bytes((shipped / "recording.yaml").read_bytes())
    known = pd.read_csv(shipped / "subjects.csv").set_index("subject", drop=False)
    rows = []
    for visit, volunteer in RECORDINGS.items():
        row = known.loc["C"].drop(["sbp_mmhg", "dbp_mmhg"], errors="ignore")
        rows.append({**row, "subject": f"N-{visit}", "person": "N", "visit": visit})
        (folder / "swe" / f"N-{visit}.csv").write_bytes((shipped / "swe" / f"{volunteer}.csv").read_bytes())
    pd.DataFrame(rows).to_csv(folder / "subjects.csv", index=False)
    return folder


@pytest.mark.slow(minutes=3)
def test_two_visits_are_compared_by_hand_as_by_the_workflow(own_study: StudyCopy, tmp_path: Path) -> None:
    study = own_study
    write_visits(study.folder / "data" / "visits", study)
    asked = ("--cohort", "data/visits", "--person", "N", "--experiment", "calibrated")
    done = study.call(
        "-m", "swesbi", "change", "--overlay", study.config, *asked, "--out", str(tmp_path / "out")
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("N: first to other\n")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *CHANGE_OUTPUTS.values(), "N-first", "N-other",
    }  # fmt: skip
    study.edit("smoke.yaml", "\ncmaes:\n", "\nnew_subjects:\n  cohort: data/visits\ncmaes:\n")
    study.run("changes")
    made = study.results / "calibrated" / "change" / "N"
    for name in ("change.h5", "change.csv"):
        assert (made / name).read_bytes() == (tmp_path / "out" / name).read_bytes()
    whole = pd.read_csv(study.results / "tables" / "changes.csv")
    assert list(whole["experiment"].unique()) == ["calibrated", "amortised"]
    assert len(whole) == 2 * len(QUANTITIES)
    found = read_change(made / "change.h5")
    assert found.visit == ("first", "other")
    assert list(found.subject) == ["N-first", "N-other"]
