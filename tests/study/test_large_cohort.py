"""A large cohort: jobs in batches, refused subjects, and a study without experiments on the cohort."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from cohorts import ungrouped
from study_copy import ROOT, Job, StudyCopy, copy_study, of_rule, rules_of

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
    study.edit(
        "config/experiments.yaml",
        "subjects: { data/virtual_volunteers: [A, B, C, D, E, F] }",
        "subjects: all",
    )


@pytest.mark.slow
def test_the_population_alone_needs_no_other_experiment(tmp_path: Path) -> None:
    rules = rules_of(copy_study(tmp_path).planned(*ALONE))
    assert {"population_cohort", "strata_figure", "training_figure", "exact_subject_figures"} <= rules
    assert not {"train", "train_flow", "simulate", "tables", "report"} & rules


def test_a_large_cohort_has_one_overview_instead_of_figures_of_each_subject(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    make_large(study, 40)
    jobs = study.planned(*ALONE, "subjects=all")
    for rule in ("ingest", "population_answers"):
        assert all(job.of_several for job in of_rule(jobs, rule))
    assert "population_cohort" in rules_of(jobs)
    assert not {"exact_subject_figures", "cmaes", "passive"} & rules_of(jobs)


def test_who_is_outside_the_declared_range_is_refused_and_the_others_answered(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    study.edit("config/population.yaml", "ivsd_cm: [0.4, 2.0]", "ivsd_cm: [0.4, 0.65]")
    raw = read_merged(study.folder / "config.yaml") | {
        "cohort": str(study.folder / "data" / "virtual_volunteers")
    }
    loaded = load_study(raw)
    assert set(loaded.answered("amortised")) == set(loaded.subjects) - set(loaded.refused("amortised"))
    assert loaded.refused("amortised")["A"].startswith("ivsd_cm = ")
    assert loaded.answered("amortised")


@pytest.mark.slow
def test_batches_of_recordings_give_the_bytes_of_single_ones(finished: StudyCopy, tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    study.edit("smoke.yaml", "population_parts: 2", "population_parts: 2\n  subjects_per_job: 2")
    # two of the three subjects make a batch, and the third is a job of its own
    jobs = study.planned("results-smoke/cohort/noise.h5")
    assert {job.output.split("/")[2]: job.of_several for job in of_rule(jobs, "ingest")} == {
        "A": True,
        "F": True,
        "G": False,
    }
    study.run("results-smoke/cohort/noise.h5")
    for path in (f"results-smoke/cohort/{subject}/observation.h5" for subject in "AFG"):
        assert (study.folder / path).read_bytes() == (finished.folder / path).read_bytes()


def test_a_target_of_one_subject_makes_that_subject_alone(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    study.edit("smoke.yaml", "population_parts: 2", "population_parts: 2\n  subjects_per_job: 4")
    observation, posterior = (
        f"results-smoke/{path}" for path in ("cohort/A/observation.h5", "amortised/subjects/A/posterior.h5")
    )
    assert study.planned(observation) == {Job("ingest", observation)}
    answers = of_rule(study.planned(posterior), "population_answers")
    assert {(Path(job.output).parent.name, job.of_several) for job in answers} == {("A", False)}
    whole = study.planned("results-smoke/amortised/cohort.csv")
    for rule in ("ingest", "population_answers"):
        assert all(job.of_several for job in of_rule(whole, rule))


@pytest.mark.parametrize("subjects", [1, 32, 33, 600])
def test_batches_hold_every_subject_once_in_order(subjects: int) -> None:
    study = load_study(read_merged(ROOT / "config.yaml"))
    names = [f"S{number}" for number in range(subjects)]
    batches = study.batches(names)
    assert [name for batch in batches for name in batch] == names
    assert len(batches) <= 32
    assert max(map(len, batches)) == -(-subjects // 32)
