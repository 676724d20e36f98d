from __future__ import annotations

import contextlib
import copy
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import rules
from study_copy import ROOT

from swesbi.config.models import Config
from swesbi.config.read import (
    ConfigError,
    merged_files,
    overlay,
    parse_config,
    parse_section,
    read_merged,
    read_yaml,
    relocate,
)
from swesbi.config.study import Study, load_study
from swesbi.recording.cohort.visits import Visit
from swesbi.recording.noise.errors import relative_se
from swesbi.recording.settings import ACQUISITION
from swesbi.recording.speed import NoiseComponents
from swesbi.study.answerer import answer_settings

SHIPPED = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
HEAVY = {"torch", "zuko", "sbi", "sklearn", "emcee", "matplotlib", "numba", "scipy", "pandas", "xarray"}
WILDCARDS = {"subject": "A", "experiment": "paper", "prior": "paper", "shard": "0", "part": "0", "batch": "0"}


def settings_of(study: Study, rule: str) -> dict[str, Any]:
    """Return the settings of a rule for the first kind of experiment that has it."""
    # those of features have all that the pool on speeds is made of, too
    wildcards = {name: value for name, value in WILDCARDS.items() if name != "prior" or rule == "simulate"}
    for experiment in ("calibrated",) if rule == "speed_pool" else ("paper", "calibrated"):
        with contextlib.suppress(ConfigError):
            return rules.settings_of(rule, study, **(wildcards | {"experiment": experiment}))
    return rules.settings_of(rule, study, **(wildcards | {"experiment": "amortised"}))


def changed(**changes: object) -> dict[str, Any]:
    """Return the shipped configuration with values set at dotted keys; None removes the key."""
    raw = copy.deepcopy(SHIPPED)
    for dotted, value in changes.items():
        *path, last = dotted.split("__")
        section = raw
        for key in path:
            section = section[key]
        if value is None:
            del section[last]
        else:
            section[last] = value
    return raw


def test_the_shipped_and_the_smoke_configuration_are_valid() -> None:
    assert load_study(SHIPPED).subjects == ("A", "B", "C", "D", "E", "F", "G", "H")
    smoke = overlay(SHIPPED, read_yaml(ROOT / "tests" / "smoke.yaml"))
    assert load_study(smoke | {"cohort": SHIPPED["cohort"]}).subjects == ("A", "F", "G")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gibberish": 1}, r"gibberish = 1: .*remove this key"),
        ({"seed": None}, r"seed: .*add this key"),
        ({"seed": "1e-3"}, r"seed = '1e-3': .*write 1.0e-3 or 0.001"),
        ({"experiments__calibrated__estimator__transfroms": 8}, r"calibrated\.est.* mean 'transforms'"),
        (
            {"priors__paper__k0_kpa__low": "1e-3"},
            r"priors\.paper\.k0_kpa\.low = '1e-3'.*YAML reads 1e-3 as text",
        ),
        ({"priors__paper__k0_kpa__log_sd": -0.5}, r"log_sd = -0\.5: .*greater than 0"),
        ({"experiments__paper__estimator__model": "mfa"}, r"estimator\.model = 'mfa'"),
        ({"priors__paper__k0_kpa__low": 50.0}, r"priors\.paper\.k0_kpa: need low < centre < high, found 50"),
        ({"priors__wide__k_atp_per_s__high": 900.0}, r"priors\.wide\.k_atp_per_s: bounds 2 to 900 leave"),
        ({"experiments__paper__prior": "wider"}, r"paper\.prior names the prior 'wider'; known .*paper"),
        ({"experiments__tables": SHIPPED["experiments"]["paper"]}, "'tables' is the name of a results"),
        ({"experiments__paper__predictive__draws": 10**6}, r"draws is 1000000, but only 1000 are there"),
        (
            {"experiments__calibrated__calibration__recordings__effective_draws": 60},
            r"network_draws is 299, but only 270 are there in the first round",
        ),
        ({"experiments__paper__support__min_in_prior_draws": 10**6}, r"met by candidate_draws = 500000"),
        ({"experiments__paper__predictive__features": ["peak"]}, r"names the feature 'peak'"),
        ({"passive__late_diastolic_window": [0.7, 0.9]}, r"= \[0\.7, 0\.9\] must equal recording\.late"),
        ({"acquisition__phases": 21}, r"acquisition\.phases = 21 must equal recording\.phases = 20"),
        ({"acquisition__missing_phases": [3]}, r"acquisition\.missing_phases = \[3\] must be empty"),
        ({"main_experiment": "calibrated", "run": "all"}, r"'calibrated': .*kind: features"),
        ({"main_experiment": "pepper"}, r"main_experiment = 'pepper'"),
        ({"run": ["pepper"]}, r"run: 'pepper' is not one of paper"),
        ({"subjects": ["A", "Z"]}, r"subjects: 'Z' has no row in .*subjects\.csv; it knows A, B, C, D, E"),
        ({"subjects": ["A", "A"]}, r"each once"),
        ({"subjects": ["../A"]}, r"subjects"),
        ({"cohort": "data/nowhere"}, r"cohort = 'data/nowhere': .*subjects\.csv"),
        ({"experiments__paper__subjects": ["A", "Z"]}, r"paper\.subjects: 'Z' has no row .*subjects: all"),
        ({"experiments__calibrated__subjects": {SHIPPED["cohort"]: ["Z"]}}, r"calibrated\.subjects: 'Z'"),
        ({"experiments__paper__subjects": []}, r"paper\.subjects = \[\]: name at least one subject"),
        ({"experiments__paper__subjects": ["A", "A"]}, r"paper\.subjects = \['A', 'A'\]: .*each once"),
        ({"experiments__paper__subjects": "A"}, r"experiments\.paper\.subjects"),
        ({"experiments__paper__subjects": None}, r"experiments\.paper\.subjects: .*add this key"),
        (
            {"subjects": ["G", "H"]},
            r"experiments\.paper\.subjects: none of A, .* F is among `subjects`, which are G, H\. Add one",
        ),
        ({"plan__persons__group": "giants"}, "plan.persons.group = 'giants': the population has adults"),
        ({"plan__studies__sizes": [8, 4, 20]}, "list them in ascending order"),
        ({"plan__experiment": "calibrated"}, "plan.experiment = 'calibrated' is no experiment over a pop"),
    ],
)
def test_a_wrong_value_is_refused_with_key_value_and_remedy(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load_study(changed(**changes))


def test_every_problem_is_listed_at_once() -> None:
    with pytest.raises(ConfigError, match="2 problem") as caught:
        parse_config(changed(seed=None, gibberish=1))
    assert len(str(caught.value).splitlines()) == 3


def test_the_paper_s_experiment_has_the_paper_s_settings() -> None:
    paper = parse_config(SHIPPED).experiments["paper"]
    assert (paper.simulations_per_subject, paper.observation_model.augmentations) == (1000, 20)
    assert list(paper.observation_model.feature_noise_sd.values()) == [1.0, 0.5, 0.5, 5.0, 0.03]
    estimator, support = paper.estimator, paper.support
    assert (estimator.transforms, estimator.hidden_features, estimator.blocks) == (5, 50, 2)
    assert (estimator.batch_size, estimator.max_num_epochs) == (128, 100)
    assert (support.max_abs_z, support.min_in_prior_draws, support.candidate_draws) == (3.0, 1000, 500_000)


def test_a_wrong_key_is_named_with_the_last_file_that_has_it_and_its_line(tmp_path: Path) -> None:
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "model.yaml").write_text("passive:\n  exponent_b: 3\n\n  exponent_c: 1\n")
    (tmp_path / "config.yaml").write_text("seed: 1\n\nsead: 2\n")
    (tmp_path / "changes.yaml").write_text("# below\npassive: { exponent_b: low }\n")
    given = (tmp_path / "config.yaml", tmp_path / "changes.yaml")
    with pytest.raises(ConfigError) as caught:
        parse_config(read_merged(*given), files=merged_files(*given))
    lines = str(caught.value).splitlines()

    def place_of(key: str) -> str:
        (line,) = [line for line in lines if line.startswith(f"  - {key}")]
        return Path(line.rsplit("(", 1)[1].removesuffix(")")).name

    assert place_of("passive.exponent_c") == "model.yaml:4"
    assert place_of("passive.exponent_b") == "changes.yaml:2"
    assert place_of("sead") == "config.yaml:3"
    (tmp_path / "own.yaml").write_text("mine:\n  seed: 1\n  sead: 2\n")
    with pytest.raises(
        ConfigError, match=r"mine\.sead = 2: no such key; did you mean 'seed'\? \(.*own\.yaml:3\)"
    ):
        parse_section({"seed": 1, "sead": 2}, "own.yaml", Config, [tmp_path / "own.yaml"], "mine")


def test_what_the_configuration_says_itself_wins_over_the_files_beside_it(tmp_path: Path) -> None:
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "a.yaml").write_text("passive: { exponent_b: 3.0, other: 1 }\n")
    (tmp_path / "config.yaml").write_text("passive: { exponent_b: 4.0 }\n")
    assert read_merged(tmp_path / "config.yaml") == {"passive": {"exponent_b": 4.0, "other": 1}}
    elsewhere = tmp_path / "elsewhere" / "mine.yaml"
    elsewhere.parent.mkdir()
    elsewhere.write_text("seed: 7\n")
    found = read_merged(elsewhere)  # what it does not say is as the files of the project have it
    assert (found["seed"], found["forward_model"]) == (7, SHIPPED["forward_model"])


@pytest.fixture
def cohort(tmp_path: Path) -> Path:
    """A copy of the shipped cohort."""
    return Path(shutil.copytree(SHIPPED["cohort"], tmp_path / "cohort"))


def test_a_subject_without_a_recording_and_a_folder_without_a_cohort_are_refused(cohort: Path) -> None:
    (cohort / "swe" / "B.csv").unlink()
    assert load_study(changed(cohort=str(cohort), subjects=["A"])).subjects == ("A",)
    with pytest.raises(ConfigError, match=r"no file .*B\.csv"):
        load_study(changed(cohort=str(cohort), subjects=["A", "B"]))
    with pytest.raises(ConfigError, match=r"recordings = .*subjects.csv"):
        load_study(SHIPPED, new_cohort=cohort.parent)


def test_the_paper_s_experiments_are_of_its_six_and_a_restriction_of_the_study_is_one_of_all() -> None:
    study = load_study(SHIPPED)
    for name in ("paper", "scalar_only", "wide_prior"):
        assert set(study.subjects_of(name)) == set("ABCDEF")
    for name in ("calibrated", "amortised"):
        assert study.subjects_of(name) == study.subjects
    assert set(study.answered("amortised")) == set(study.subjects)
    fewer = load_study(changed(subjects=["G", "B", "A"]))
    assert fewer.subjects_of("paper") == ("B", "A")
    assert fewer.subjects_of("calibrated") == ("G", "B", "A")
    without = load_study(changed(subjects=["G", "H"], run=["amortised"]) | {"main_experiment": "paper"})
    assert without.answered("amortised") == ("G", "H")
    assert without.subjects_of("paper") == ()


def test_an_experiment_over_a_population_has_the_subjects_of_its_base() -> None:
    study = load_study(changed(experiments__calibrated__subjects=["H", "A"]))
    assert study.subjects_of("amortised") == study.answered("amortised") == ("A", "H")
    contexts = rules.settings_of("population_cohort", study, experiment="amortised")["cohort_contexts"]
    assert [row["subject"] for row in contexts] == ["A", "H"]


def test_a_list_of_one_cohort_says_nothing_of_another(cohort: Path) -> None:
    assert load_study(changed(cohort=str(cohort))).subjects_of("paper") == load_study(SHIPPED).subjects
    of_both = SHIPPED["experiments"]["paper"]["subjects"] | {str(cohort): ["B"]}
    study = load_study(changed(cohort=str(cohort), experiments__paper__subjects=of_both))
    assert study.subjects_of("paper") == ("B",)


def test_a_subject_that_an_experiment_does_not_have_is_refused_by_its_stages() -> None:
    study = load_study(SHIPPED)
    assert rules.settings_of("verdict", study, experiment="calibrated", subject="G")
    with pytest.raises(
        ConfigError, match=r"'G': not one of the experiment 'paper', which has A, B, .*F; exp"
    ):
        rules.settings_of("posterior", study, experiment="paper", subject="G")
    narrow = "population_experiments__amortised__population__declared_range__hr_bpm"
    refusing = load_study(changed(**{narrow: [60.0, 130.0]}))
    with pytest.raises(ConfigError, match=r"'A': refused by 'amortised': hr_bpm = 57"):
        rules.settings_of("exact_subject_figures", refusing, experiment="amortised", subject="A")
    with pytest.raises(ConfigError, match="subject = 'Z': unknown; the study has A, B"):
        rules.settings_of("ingest", study, subject="Z")
    with pytest.raises(ConfigError, match="say which experiment"):
        rules.settings_of("pool", study)


def test_persons_and_groups_reach_the_posterior_of_the_cohort() -> None:
    visits = {"A": Visit("P", "before", "treated"), "B": Visit("P", "after", "treated"), "C": Visit()}
    shipped = load_study(SHIPPED)
    study = replace(shipped, cohort=replace(shipped.cohort, declared_visits=visits))
    settings = rules.settings_of("cohort_posterior", study, experiment="calibrated")
    told = {"person": "P", "group": "treated"}
    assert settings["visits"] == {"A": told, "B": told}
    assert rules.settings_of("cohort_posterior", load_study(SHIPPED), experiment="amortised")["visits"] == {}


def test_the_acquisition_is_that_of_the_virtual_volunteers() -> None:
    """Also the sizes that what follows from it is chosen by: the standard error of a phase mean."""
    config = parse_config(SHIPPED)
    assert config.acquisition == ACQUISITION
    noise = NoiseComponents(
        ACQUISITION.repeat_sd_fraction, ACQUISITION.sample_sd_fraction, ACQUISITION.sweep_fraction
    )
    counts = np.full((1, ACQUISITION.repeats), ACQUISITION.samples_per_repeat)
    (error,) = relative_se(counts, noise)
    section = config.population_experiments["amortised"]
    low, high = section.conditions.relative_se
    assert low < error / 2 and 2 * error < high
    cuts = np.geomspace(low, high, 4)[1:-1]
    np.testing.assert_allclose(section.calibration.strata.relative_se, cuts, rtol=0.005)


@pytest.mark.parametrize("content", ["- a\n- b\n", "a: [1, 2\n", ""])
def test_a_file_that_is_no_mapping_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "config.yaml").write_text(content)
    with pytest.raises(ConfigError, match=r"config\.yaml"):
        read_yaml(tmp_path / "config.yaml")


SHOWING = {"report", "paper_comparison"}  # they print the configuration
RECALIBRATED = {"population_calibration", "pushes_calibration"}
REPEATED = RECALIBRATED | {"population_null"}  # with other recordings of a population
RESAMPLED = REPEATED | {"exact_posterior", "calibration_local", "calibration_recordings"}
RESAMPLED |= {"population_answers", "cohort_posterior"}
OF_A_RECORDING = RESAMPLED | {"train_flow", "predictive_speeds", "verdict", "identifiability"}
OF_A_RECORDING |= {"population_simulate", "train_population", "pressures_table"}
"""The stages that hold the model of a recording's speeds."""
OF_THE_PRIOR = {"exact_figures", "exact_subject_figures", "population_agreement", "population_cohort"}
RECOVERED = {"recovery", "recovery_acquisition", "epochs"}
JUDGED = {"verdict", "calibration", "population_scores", "pushes_table", "population_answers"}
PAPER, CALIBRATED = "experiments__paper__", "experiments__calibrated__"
AMORTISED = "population_experiments__amortised__"
AFFECTED = {
    PAPER + "predictive__draws": {"predictive", "epochs"},
    PAPER + "estimator__learning_rate": {"train"},
    PAPER + "observation_model__augmentations": {"pool", "predictive", "recovery", "epochs"},
    PAPER + "support__candidate_draws": {"posterior", "epochs"},
    PAPER + "recovery__recordings": RECOVERED,
    PAPER + "epoch_study__candidate_draws": {"epochs"},
    PAPER + "epoch_study__checkpoint_epochs": {"train"},
    CALIBRATED + "estimator__learning_rate": {"train_flow"},
    CALIBRATED + "simulations_per_subject": {"speed_pool"},
    CALIBRATED + "observation_model__discrepancy__speed_fraction": OF_A_RECORDING,
    CALIBRATED + "exact__min_effective_draws": RESAMPLED,
    CALIBRATED + "calibration__recordings__model_noise": RECALIBRATED | {"calibration_recordings"},
    CALIBRATED + "misspecification__rule__tail_fraction": JUDGED,
    CALIBRATED + "identifiability__information_draws": {"identifiability"},
    CALIBRATED + "passive_stiffness_kpa__log_sd": OF_A_RECORDING | OF_THE_PRIOR,
    # of the measurement: no simulation depends on it
    "priors__calibrated__nuisances__passive_ratio__log_sd": OF_A_RECORDING | OF_THE_PRIOR,
    AMORTISED + "population__broad_share": REPEATED | {"population_simulate"},
    AMORTISED + "conditions__missing_fraction": REPEATED | {"train_population"},
    AMORTISED + "simulations__draws_per_context": {"population_simulate"},
    AMORTISED + "estimator__learning_rate": {"train_population"},
    AMORTISED + "calibration__model_noise": {"population_calibration"},
    AMORTISED + "calibration__free_running__recordings": {"pushes_calibration"},
    AMORTISED + "calibration__strata__hr_bpm": {"population_scores"},
    AMORTISED + "calibration__two_sample_draws": {"population_agreement"},
    AMORTISED + "nulls__recordings": {"population_null"},
    "cohort_posterior__draws": {"cohort_posterior"},
    "cohort_posterior__hyperprior__spread__log_sd": {"cohort_posterior"},
    "clinical__sbp_sd_mmhg": {"population_answers"},
    "passive__exponent_b": {"passive", "recovery_acquisition"},
    "recording__min_samples_per_phase": REPEATED
    | {"ingest", "noise", "recovery_acquisition", "calibration_recordings", "train_population"},
    "new_subjects__margin_fraction": set(),
    "new_subjects__uninformative__shift": {"population_answers"},
    "noise__interval": {"noise"},
    "cmaes__search__generations": {"cmaes"},
    "forward_model__steps_per_beat": OF_A_RECORDING
    | RECOVERED
    | {"simulate", "passive", "predictive", "cmaes"},
    "resources__device": set(),
}


def another(value: str | float | list[int]) -> str | float | list[int]:
    """Return another valid value: other device, shorter list, smaller number."""
    if isinstance(value, str):
        return {"auto": "cpu"}[value]
    if isinstance(value, list):
        return value[:-1]
    return value // 2 if isinstance(value, int) else value / 2


@pytest.mark.parametrize("key", AFFECTED)
def test_a_value_reaches_the_stages_that_use_it_and_no_other(key: str) -> None:
    value: Any = SHIPPED
    for part in key.split("__"):
        value = value[part]
    before, after = load_study(SHIPPED), load_study(changed(**{key: another(value)}))
    differing = {stage for stage in rules.STAGES if settings_of(before, stage) != settings_of(after, stage)}
    assert differing - SHOWING == AFFECTED[key]
    assert AFFECTED[key] or not differing


def test_an_answer_has_the_settings_that_the_stages_have_for_a_subject_of_the_cohort() -> None:
    study = load_study(SHIPPED, new_cohort=Path(SHIPPED["cohort"]))
    found = answer_settings(study, "calibrated", "A").to_plain()
    for rule in ("ingest", "exact_posterior", "verdict", "predictive_speeds"):
        settings = rules.settings_of(rule, study, experiment="calibrated", subject="A")
        assert all(found[name] == value for name, value in settings.items() if name != "grid_points")
    assert found["cohort_title"] == study.outside.title
    assert found["uninformative"] == SHIPPED["new_subjects"]["uninformative"]


def test_who_has_pressures_is_answered_with_them(cohort: Path) -> None:
    assert load_study(SHIPPED).with_pressures("amortised") == tuple("ABCDEFGH")
    table = pd.read_csv(cohort / "subjects.csv", dtype=str).set_index("subject")
    table.loc["B", ["sbp_mmhg", "dbp_mmhg"]] = ""
    table.to_csv(cohort / "subjects.csv")
    fewer = load_study(changed(cohort=str(cohort)), new_cohort=cohort)
    assert fewer.with_pressures("amortised") == tuple("ACDEFGH")
    measured = {name: fewer.outside.clinical_of(name).to_measures() for name in fewer.outside.rows}
    assert [name for name, clinical in measured.items() if clinical.has_pressures] == list("ACDEFGH")


def test_reading_the_configuration_and_the_workflow_loads_no_heavy_library() -> None:
    """Every job, every command and every parse of the Snakefile imports these modules first."""
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    modules = set(re.findall(r"^from (swesbi[\w.]*) import", "\n".join(texts), re.MULTILINE))
    assert {"swesbi.config.study", "swesbi.config.view", "swesbi.study.stage"} <= modules
    script = f"import sys, {', '.join(sorted(modules))}; print(sorted({HEAVY} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_cohorts_of_lists_of_subjects_count_from_the_file_that_names_them(
    tmp_path: Path,
) -> None:
    path = tmp_path / "elsewhere" / "changes.yaml"
    path.parent.mkdir()
    path.write_text("experiments: {paper: {subjects: {mine: [A]}}}\n", encoding="utf-8")
    listed = read_merged(ROOT / "config.yaml", path)["experiments"]["paper"]["subjects"]
    assert listed[str(path.parent.resolve() / "mine")] == ["A"]
    for said in (None, {"paper": None}, {"paper": {"subjects": "all"}}):
        merged = {"experiments": said}
        relocate(merged, path, ROOT)
        assert merged == {"experiments": said}
