"""The commands `change` and `plan` and the target `changes` on a finished small study."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from study_copy import StudyCopy

from swesbi.change.ratios import QUANTITIES
from swesbi.change.stored import read_change
from swesbi.change.stored_groups import read_change_groups
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


@pytest.mark.slow(minutes=3)
def test_groups_and_who_is_left_out(own_study: StudyCopy) -> None:
    """Two persons of two groups who came twice, one who came once and one whom the network refuses."""
    study = own_study
    folder = write_visits(study.folder / "data" / "visits", study)
    table = pd.read_csv(folder / "subjects.csv").assign(group="treated")
    again = table.assign(subject=table["subject"].str.replace("N-", "M-"), person="M", group="control")
    far = again.assign(subject=again["subject"].str.replace("M-", "F-"), person="F", hr_bpm=139.0)
    once = again.iloc[:1].assign(subject="O-first", person="O")
    pd.concat([table, again, far, once]).to_csv(folder / "subjects.csv", index=False)
    for name in [*again["subject"], *far["subject"], *once["subject"]]:
        visit = name.split("-")[1]
        (folder / "swe" / f"{name}.csv").write_bytes((folder / "swe" / f"N-{visit}.csv").read_bytes())
    study.edit(
        "smoke.yaml", "\ncmaes:\n", "\nrun: [amortised]\nnew_subjects:\n  cohort: data/visits\ncmaes:\n"
    )
    study.run("changes")
    groups = pd.read_csv(study.results / "tables" / "changes_groups.csv")
    assert list(groups["experiment"].unique()) == ["amortised"]
    found = read_change_groups(study.results / "amortised" / "changes_groups.h5")
    assert found.person == ("N", "M")
    assert found.groups == ()  # one person of each group
    assert "left out with one visit, since a change needs two: O" in found.notes
    assert "F is left out: visit 'first' (recording F-first) is refused, hr_bpm = 139" in found.notes
    assert "has one person" in found.notes
    assert (study.results / "figures" / "changes_groups-amortised.pdf").is_file()


@pytest.mark.slow(minutes=3)
def test_a_study_is_planned_and_its_persons_are_kept(own_study: StudyCopy) -> None:
    def plan(*further: str) -> str:
        done = own_study.call(
            "-m", "swesbi", "plan", "--overlay", own_study.config, "--effect", "k_sr=-20%", *further
        )
        assert done.returncode == 0, done.stderr
        return str(done.stdout)

    said = plan("--bank", "4", "--persons", "8")
    assert said.startswith("k_SR -20 %, paired, repeats with errors of 3.0%:")
    assert "This assumes:" in said
    folder = own_study.results / "amortised" / "plan"
    table = pd.read_csv(folder / "paired-k_sr_per_s-20" / "plan.csv")
    assert list(table["persons"]) == [4, 8, 16]
    assert table["power_1"].between(0.0, 1.0).all()
    (bank,) = (folder / "banks").iterdir()
    kept, written = bank.read_bytes(), bank.stat().st_mtime_ns
    assert plan("--bank", "4", "--persons", "8") == said
    assert (bank.read_bytes(), bank.stat().st_mtime_ns) == (kept, written)
    assert "persons in each of two groups" in plan("--bank", "4", "--design", "groups", "--repeats", "2,3")
