"""What reruns when, and that neither cores nor the order of jobs matter."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from study_arrays import assert_equal_results
from study_copy import RESULTS, StudyCopy, copy_study, of_rule, rules_of

from swesbi.report.figures.registry import names_of
from swesbi.report.page.names import FURTHER

SHOWN = {"cohort_figures", "tables", "paper_comparison", "report"}  # of every experiment
PREDICTIVE = {"predictive", "subject_figures", "workflow_figure"} | SHOWN
SAMPLED = {"posterior", "truth"} | PREDICTIVE
EPOCHS = {"epochs"}
TRAINED = {"train", "recovery", "recovery_acquisition", "training_figure"} | EPOCHS | SAMPLED


@contextmanager
def edited(study: StudyCopy, path: str, old: str, new: str) -> Iterator[None]:
    """Edit a file and put it back, its modification time included."""
    file = study.folder / path
    before, times = file.read_bytes(), file.stat()
    try:
        study.edit(path, old, new)
        yield
    finally:
        file.write_bytes(before)
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))


EDITS = {
    "ppc setting": (
        "smoke.yaml", "      draws: 50\n    recovery", "      draws: 40\n    recovery", EPOCHS | PREDICTIVE,
    ),
    "training setting": ("smoke.yaml", "learning_rate: 0.002", "learning_rate: 0.001", TRAINED),
    "noise": ("config/experiments.yaml", "maximum_kpa: 1.0", "maximum_kpa: 2.0", {"pool"} | TRAINED),
    "cma-es": (
        "smoke.yaml", "generations: 5", "generations: 4",
        {"cmaes", "subject_figures", "exact_subject_figures", "exact_figures"} | SHOWN,
    ),
    "comment": ("config.yaml", "shards_per_subject: 1", "shards_per_subject: 1 # as before", set()),
    "device": ("config.yaml", "device: auto", "device: cpu", set()),
    "stage code": (
        "src/swesbi/checks/predictive_features.py", 'of_curves = generator(seed, "observed',
        'of_curves = generator(seed + 1, "observed', PREDICTIVE,
    ),
    "imported code": (
        "src/swesbi/networks/paper/training.py", '"sbi: %s", printed', '"sbi said: %s", printed', TRAINED,
    ),
    "docstring of a stage": ("src/swesbi/networks/paper/training.py", '"""Train q', '"""Fit q', set()),
}  # fmt: skip
"""File, text there, what takes its place, and the rules that run then."""


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_reruns_what_it_affects(editable: StudyCopy, edit: str) -> None:
    path, old, new, rules = EDITS[edit]
    with edited(editable, path, old, new):
        assert rules_of(editable.planned()) == rules


@pytest.mark.parametrize(
    ("path", "old", "new", "among", "not_among"),
    [
        (
            "config/model.yaml", "destruction_alpha: 1.5", "destruction_alpha: 1.6",
            {"simulate", "passive", "pool", "cmaes"}, set(),
        ),
        (
            "config/experiments.yaml", "doubtful_level: 0.03", "doubtful_level: 0.04",
            {"verdict"}, {"exact_posterior", "posterior", "population_null", "train_flow", "train"},
        ),
        (
            "config/experiments.yaml", "    subjects: all\n", "    subjects: [A, F]\n",
            {"speed_pool", "train_flow", "exact_posterior", "calibration", "verdict", "identifiability",
             "exact_figures", "tables", "truth", "report"},
            {"ingest", "noise", "simulate", "pool", "train", "posterior", "predictive", "cohort_figures",
             "train_population", "population_null"},
        ),
    ],
    ids=["the model", "level of an alarm", "subjects of an experiment"],
)  # fmt: skip
def test_an_edit_reruns_some_rules_and_not_others(
    editable: StudyCopy, path: str, old: str, new: str, among: set[str], not_among: set[str]
) -> None:
    with edited(editable, path, old, new):
        rules = rules_of(editable.planned())
    assert among <= rules
    assert not rules & not_among


def test_saving_a_recording_again_reruns_nothing(editable: StudyCopy) -> None:
    for name in ("swe/A.csv", "subjects.csv"):
        file = editable.folder / "data" / "virtual_volunteers" / name
        file.write_bytes(file.read_bytes())
    assert editable.planned() == set()


def test_a_subject_more_is_the_only_one_simulated_and_one_alone_needs_no_other_after_pooling(
    editable: StudyCopy, tmp_path: Path
) -> None:
    with edited(editable, "smoke.yaml", "subjects: [A, F, G]", "subjects: [A, F, G, C]"):
        jobs = editable.planned()
    for rule in ("ingest", "passive", "simulate", "cmaes"):
        assert all(job.is_of("C") for job in of_rule(jobs, rule))
    assert "pool" in rules_of(jobs)
    one = copy_study(tmp_path).planned(f"{RESULTS}/paper/subjects/A/ppc.png")
    for rule in ("posterior", "predictive", "subject_figures", "cmaes"):
        assert all(job.is_of("A") for job in of_rule(one, rule))


def test_every_experiment_is_made_of_its_own_subjects(tmp_path: Path) -> None:
    jobs = copy_study(tmp_path).planned()
    simulated = {tuple(job.output.split("/")[2:4]) for job in of_rule(jobs, "simulate")}
    assert simulated == {("paper", name) for name in "AF"} | {("calibrated", name) for name in "AFG"}
    for rule in ("posterior", "predictive", "subject_figures"):
        assert {job.output.split("/")[3] for job in of_rule(jobs, rule)} == set("AF")
    for rule in ("exact_posterior", "verdict", "calibration_local", "exact_subject_figures"):
        assert {job.output.split("/")[3] for job in of_rule(jobs, rule)} == set("AFG")
    for rule in ("ingest", "cmaes"):
        assert sum(job.is_of("G") for job in of_rule(jobs, rule)) == 1


def test_a_subject_that_an_experiment_does_not_have_is_refused_by_name(tmp_path: Path) -> None:
    done = copy_study(tmp_path).snakemake("--dry-run", f"{RESULTS}/paper/subjects/G/ppc.png")
    assert done.returncode != 0
    assert "'G': not one of the experiment 'paper', which has A, F" in done.stdout + done.stderr


EXPLORER = """
if SPEED_EXPERIMENTS:

    rule explorer:
        output:
            f"{RESULTS}/explorer.html",
        shell:
            "touch {output}"
"""


@pytest.mark.slow
def test_the_whole_study_is_planned_without_what_stands_beside_it(tmp_path: Path) -> None:
    """A copy has neither the explorer nor side studies; with a page of that name it makes that page more."""
    study = copy_study(tmp_path)
    assert not any((study.folder / name).exists() for name in ("explorer", "studies"))
    without = study.planned()
    made = {job.output.removeprefix(f"{RESULTS}/") for job in without}
    figures = [*names_of("cohort"), *(f"{name}-calibrated" for name in names_of("speeds"))]
    tables = ("ppc", "features", "posterior", "paper_comparison", "truth")
    expected = {"index.html", *(f"report/{name}.html" for name in FURTHER)}
    expected |= {f"figures/{name}.png" for name in figures} | {f"tables/{name}.csv" for name in tables}
    assert expected | {"calibrated/calibration.csv", "amortised/strata.csv"} <= made
    assert not [name for name in made if "explorer" in name]
    (study.folder / "explorer").mkdir()
    (study.folder / "explorer" / "rules.smk").write_text(EXPLORER, encoding="utf-8")
    further = study.planned() - without
    assert {job.output for job in further} == {f"{RESULTS}/explorer.html"}


def test_the_page_is_made_of_the_validation_that_is_stored(tmp_path: Path) -> None:
    study, stored = copy_study(tmp_path), "stored/validation.csv"
    study.edit("smoke.yaml", "validation_table: null", f"validation_table: {stored}")
    before = files_of_the_page(study)
    (study.folder / stored).parent.mkdir(parents=True)
    (study.folder / stored).touch()
    assert stored not in before and stored in files_of_the_page(study)


def files_of_the_page(study: StudyCopy) -> str:
    """Return every file that the page is made of, as a graph in text."""
    done = study.snakemake("--filegraph", "results-smoke/index.html")
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_row_of_the_table_reruns_its_subject_alone(editable: StudyCopy) -> None:
    path = "data/virtual_volunteers/subjects.csv"
    names, *lines = (editable.folder / path).read_text().splitlines()
    line = next(line for line in lines if line.startswith("F,"))
    cells = line.split(",")
    place = names.split(",").index("hr_bpm")
    cells[place] = f"{float(cells[place]) + 1:g}"
    with edited(editable, path, line, ",".join(cells)):
        jobs = editable.planned()
    for rule in ("ingest", "passive", "simulate"):
        assert all(job.is_of("F") for job in of_rule(jobs, rule))


def test_one_file_made_again_runs_its_subject_alone_and_leaves_nothing_to_do(own_study: StudyCopy) -> None:
    path = "results-smoke/calibrated/subjects/A/verdict.json"
    forced = own_study.snakemake("--dry-run", "--force", path)
    assert forced.returncode == 0, forced.stdout + forced.stderr
    said = (forced.stdout + forced.stderr).splitlines()
    assert [line for line in said if line.startswith("rule ")] == ["rule verdict:"]
    assert "    wildcards: experiment=calibrated, subject=A" in said
    before = (own_study.folder / path).read_bytes()
    (own_study.folder / path).unlink()
    own_study.run(path)
    assert (own_study.folder / path).read_bytes() == before
    assert own_study.planned() == set()


def test_a_wrong_configuration_stops_before_any_job(editable: StudyCopy) -> None:
    with edited(editable, "config/model.yaml", "sd_fraction: 0.06 # chosen", "sd_fraction: 6e-2 # chosen"):
        done = editable.snakemake("--dry-run")
    assert done.returncode != 0
    assert "acquisition.sample_sd_fraction = '6e-2'" in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr


@pytest.mark.slow
def test_a_failing_stage_names_the_fault_and_keeps_the_traceback(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    recording = study.folder / "data" / "virtual_volunteers" / "swe" / "A.csv"
    recording.write_text(recording.read_text().replace(",ok", ",fine", 1))
    done = study.snakemake("results-smoke/cohort/A/observation.h5")
    assert done.returncode != 0
    assert "A.csv" in done.stderr and "'fine'" in done.stderr
    assert "Traceback" in (study.results / "logs" / "ingest" / "A.log").read_text()
    assert not (study.results / "cohort" / "A" / "observation.h5").exists()


MADE_AGAIN = (  # simulations, a pool, networks of both kinds, posteriors of all three
    "simulations/paper/A/shard-0.h5",
    "paper/pool.h5",
    "paper/estimator.h5",
    "paper/subjects/A/posterior.h5",
    "paper/subjects/A/predictive.h5",
    "calibrated/flow.h5",
    "calibrated/subjects/A/calibration_recordings.h5",
    "amortised/subjects/A/posterior.h5",
)


@pytest.mark.slow(minutes=1)
def test_one_core_and_two_give_equal_arrays(finished: StudyCopy, own_study: StudyCopy) -> None:
    made = [own_study.results / name for name in MADE_AGAIN]
    for path in made:
        path.unlink()
    own_study.run(*(str(path.relative_to(own_study.folder)) for path in made), cores=1)
    assert all(path.is_file() for path in made)
    assert assert_equal_results(own_study.results, finished.results) > 30


@pytest.mark.exhaustive(minutes=25)
def test_one_core_and_two_give_equal_arrays_in_every_artefact(finished: StudyCopy, tmp_path: Path) -> None:
    study = copy_study(tmp_path / "one-core")
    study.run(cores=1)
    assert assert_equal_results(study.results, finished.results) > 30


def test_every_experiment_runs_and_shares_what_it_can(editable: StudyCopy) -> None:
    priors = {path.name for path in (editable.results / "simulations").iterdir()}
    assert priors == {"paper", "calibrated"}
    for experiment in ("paper", "scalar_only", "calibrated", "amortised"):
        assert (editable.results / experiment / "subjects" / "A" / "ppc.png").is_file()
    with edited(editable, "config/priors.yaml", "log_sd: 0.12,", "log_sd: 0.11,"):
        jobs = editable.planned()
    assert {job.output.split("/")[2] for job in of_rule(jobs, "simulate")} == {"calibrated"}
    assert "train_flow" in rules_of(jobs) and "train" not in rules_of(jobs)
