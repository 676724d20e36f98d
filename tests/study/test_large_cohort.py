"""A large cohort: one overview, refused subjects, and a study without experiments on the cohort."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from cohorts import ungrouped
from study_copy import Job, StudyCopy, copy_study, of_rule, rules_of

from swesbi.config.read import read_merged
from swesbi.config.study import load_study

ALONE = ("--config", "run=[amortised]")


def make_large(study: StudyCopy, subjects: int) -> None:
    """Let the copy's cohort have so many subjects, all with the recording of the first."""
    cohort = study.folder / "data" / "virtual_volunteers"
    rows = list(csv.DictReader((cohort / "subjects.csv").open(newline="")))
    first = next(row for row in rows if row["subject"] == "A")
    names = [f"S{number:03d}" for number in range(subjects)]
    with (cohort / "subjects.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(first))
        writer.writeheader()
        writer.writerows(first | {"subject": name} for name in names)
    recording = (cohort / "swe" / "A.csv").read_bytes()
    for path in (cohort / "swe").iterdir():
        path.unlink()
    for name in names:
        (cohort / "swe" / f"{name}.csv").write_bytes(recording)
    (cohort / "truth.csv").unlink()
    (cohort / "recording.yaml").write_text(ungrouped(cohort), encoding="utf-8")
    of_six = "subjects: { data/virtual_volunteers: [A, B, C, D, E, F] }"
    study.edit("config/experiments.yaml", of_six, "subjects: all")


@pytest.mark.slow
def test_the_population_alone_needs_no_other_experiment(tmp_path: Path) -> None:
    rules = rules_of(copy_study(tmp_path).planned(*ALONE))
    assert {"population_cohort", "strata_figure", "training_figure", "exact_subject_figures"} <= rules
    assert not {"train", "train_flow", "simulate", "tables", "report"} & rules


def test_a_large_cohort_has_one_overview_instead_of_figures_of_each_subject(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    make_large(study, 40)
    jobs = study.planned(*ALONE, "subjects=all")
    for rule in ("ingest", "population_answers_with_pressures"):
        assert len({Path(job.output).parent for job in of_rule(jobs, rule)}) == 40
    assert "population_cohort" in rules_of(jobs)
    assert not {"exact_subject_figures", "cmaes", "passive"} & rules_of(jobs)


def test_who_is_outside_the_declared_range_is_refused_and_the_others_answered(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    study.edit("config/population.yaml", "ivsd_cm: [0.4, 2.0]", "ivsd_cm: [0.4, 0.65]")
    cohort = {"cohort": str(study.folder / "data" / "virtual_volunteers")}
    loaded = load_study(read_merged(study.folder / "config.yaml") | cohort)
    refused = loaded.refused("amortised")
    assert refused["A"].startswith("ivsd_cm = ")
    assert {*loaded.answered("amortised")} == {*loaded.subjects} - {*refused} != set()


def test_a_target_of_one_subject_makes_that_subject_alone(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    observation = "results-smoke/cohort/A/observation.h5"
    assert study.planned(observation) == {Job("ingest", observation)}
    jobs = study.planned("results-smoke/amortised/subjects/A/posterior.h5")
    answers = of_rule(jobs, "population_answers_with_pressures")
    assert {Path(job.output).parent.name for job in answers} == {"A"}
