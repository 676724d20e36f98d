"""Answers over a population: calibrated parts join, strata partition, batches answer as single jobs do."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import population_case as case
import pytest
from exact_case import SETTINGS
from observed_cohort import write_observed_cohort

from swesbi.artefacts import ArtefactError, Origin, Provenance, load, save
from swesbi.checks.calibration.dataset import FRESH as CALIBRATION
from swesbi.checks.calibration.dataset import fresh_dataset, fresh_of
from swesbi.checks.calibration.dataset import join_fresh as join
from swesbi.checks.calibration.fresh import FreshInferred, infer_fresh, strata
from swesbi.checks.calibration.settings import RecordingsSettings
from swesbi.context import Context
from swesbi.networks.flow.cells import CellConditioner
from swesbi.networks.flow.files import KIND, load_flow, save_flow
from swesbi.population.recordings import ACQUIRED, OWN, fresh_subject, record_fresh, recorded
from swesbi.posterior.result import read_exact_posterior
from swesbi.study.stages import answers as stage
from swesbi.verdict.context import declared_refusal
from swesbi.verdict.contraction import CONTRACTION
from swesbi.verdict.null_recordings import KIND as NULL
from swesbi.verdict.null_recordings import NullRecordings, draw_nulls, null_groups, read_nulls
from swesbi.verdict.verdict import read_verdict

BASE = case.CONFIG.speed_experiments[case.EXPERIMENT.base]
EXACT = SETTINGS.model_copy(
    update={
        "first_draws": 500,
        "round_draws": 500,
        "max_rounds": 4,
        "effective_draws": 100,
        "min_effective_draws": 50,
        "draws": 400,
        "mcmc": SETTINGS.mcmc.model_copy(
            update={"walkers": 16, "steps": 24, "max_steps": 24, "max_r_hat": 9.0, "min_effective_draws": 1}
        ),
    }
)
SIZES = RecordingsSettings(own=1, acquired=1, network_draws=49, effective_draws=20, misfit_draws=20)


@cache
def parts(start: int, stop: int, kind: str = OWN) -> FreshInferred:
    flow = case.trained().flow
    return infer_fresh(range(start, stop), kind, flow, case.FRESH, SIZES, EXACT, seed=7)


def test_the_network_of_a_population_is_kept_with_what_it_sees(tmp_path: Path) -> None:
    flow = case.trained().flow
    save_flow(tmp_path / "flow.pt", flow, Provenance(KIND, "", 1, {}, "0" * 16))
    again, _ = load_flow(tmp_path / "flow.pt")
    assert isinstance(again.conditioner, CellConditioner)
    recording = fresh_subject(0, case.FRESH, 7, "a").model.recording
    assert np.array_equal(again.conditioner.condition(recording), flow.conditioner.condition(recording))
    assert again.components == flow.components


def test_a_fresh_context_depends_on_its_number_alone_and_was_not_trained_on() -> None:
    first, again = fresh_subject(5, case.FRESH, 7, "a"), fresh_subject(5, case.FRESH, 7, "a")
    assert first.context == again.context
    assert first.context not in case.made().contexts
    assert first.context != fresh_subject(5, case.FRESH, 7, "b").context
    low, high = case.EXPERIMENT.conditions.relative_se
    assert low < first.level < high


def test_a_recording_acquired_sample_by_sample_has_the_noise_and_phases_that_were_drawn() -> None:
    for number in range(4):
        subject = fresh_subject(number, case.FRESH, 7, "a")
        model = recorded(subject, record_fresh(subject, ACQUIRED, case.FRESH, 7, "a", ACQUIRED))
        assert len(model.recording.phase) <= 20 - len(subject.missing)
        assert np.median(model.recording.relative_se) == pytest.approx(subject.level, rel=0.1)


@pytest.mark.slow
def test_parts_of_the_calibration_join_to_what_one_part_would_be(tmp_path: Path) -> None:
    for number, (start, stop) in enumerate(((0, 2), (2, 4))):
        groups = {kind: fresh_dataset(parts(start, stop, kind)) for kind in (OWN, ACQUIRED)}
        save(tmp_path / f"part-{number}.h5", groups, Provenance(CALIBRATION, "", 1, {}, "0" * 16))
    joined = fresh_of(join([tmp_path / "part-0.h5", tmp_path / "part-1.h5"])[OWN])
    whole = parts(0, 4)
    assert joined.contexts == whole.contexts
    assert np.array_equal(joined.relative_se, whole.relative_se)
    for name in ("level", "mean", "sd"):
        found, expected = (getattr(one.inferred.ranked.weighted, name) for one in (joined, whole))
        assert np.array_equal(found, expected), name


def test_strata_of_a_value_are_a_partition_with_the_cuts_where_they_are_said() -> None:
    ages = [8.0, 17.9, 18.0, 39.0, 40.0, 70.0]
    contexts = [
        Context("T", "F" if n % 2 else "M", age, 1.7, 66.0, 90.0, 34.0, 0.8) for n, age in enumerate(ages)
    ]
    found = strata(contexts, np.full(6, 0.03), case.EXPERIMENT.calibration.strata)
    by_age = {name: part for name, part in found.items() if name.startswith("age")}
    assert np.array_equal(np.sum(list(by_age.values()), axis=0), np.ones(6))
    assert by_age["age_years below 18"].tolist() == [True, True, False, False, False, False]
    assert by_age["age_years 63 and more"].tolist() == [False] * 5 + [True]
    assert found["sex F"].sum() == 3


def test_hypertrophied_and_dilated_hearts_are_strata_of_their_own() -> None:
    hearts = [(90.0, 0.8), (100.0, 1.5), (220.0, 0.9)]
    contexts = [Context("T", "F", 50.0, 1.7, 66.0, lvedv, 0.4 * lvedv, ivsd) for lvedv, ivsd in hearts]
    found = strata(contexts, np.full(3, 0.03), case.EXPERIMENT.calibration.strata)
    assert found["ivsd_cm 1.2 and more"].tolist() == [False, True, False]
    assert found["lvedv_ml 160 and more"].tolist() == [False, False, True]


def drawn_nulls(gated: int, pushes: int) -> NullRecordings:
    changes = {"recordings": gated, "free_running_recordings": pushes, "effective_draws": 20}
    sizes = case.EXPERIMENT.nulls.model_copy(update=changes)
    return draw_nulls(case.trained().flow, case.FRESH, sizes, EXACT, seed=7)


def test_null_recordings_are_kept_and_do_not_depend_on_how_many_there_are(tmp_path: Path) -> None:
    null, fewer = drawn_nulls(6, 5), drawn_nulls(3, 3)
    save(tmp_path / "null.h5", null_groups(null), Provenance(NULL, "", 1, {}, "0" * 16))
    read = read_nulls(tmp_path / "null.h5")
    assert read.contexts == null.contexts
    assert null.contexts[:3] == fewer.contexts
    for of_all, of_file, of_few in (
        (null.gated, read.gated, fewer.gated),
        (null.pushes, read.pushes, fewer.pushes),
    ):
        for name in ("points", "error_fraction", "errors_log_sd", "residuals_p", "bound_ratio"):
            np.testing.assert_array_equal(getattr(of_file, name), getattr(of_all, name))
            np.testing.assert_array_equal(getattr(of_few, name), getattr(of_all, name)[:3])
    assert (null.gated.errors_log_sd == 0.0).all()


def test_a_heart_outside_the_declared_range_is_refused_with_the_value_and_the_limits() -> None:
    inside = Context("T", "F", 25.0, 1.7, 66.0, 90.0, 34.0, 0.8)
    assert declared_refusal(inside, case.EXPERIMENT.population) == ""
    outside = Context("T", "F", 25.0, 1.7, 140.0, 90.0, 34.0, 0.8)
    said = declared_refusal(outside, case.EXPERIMENT.population)
    assert re.search(r"T is refused.*\n.*hr_bpm = 140 is outside \[40, 130\]", said)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Network, nulls, noise and two recordings of a cohort, as files."""
    folder = tmp_path_factory.mktemp("answers")
    save_flow(folder / "flow.pt", case.trained().flow, Provenance(KIND, "", 1, {}, "0" * 16))
    null = drawn_nulls(20, 5)
    save(folder / "null.h5", null_groups(null), Provenance(NULL, "", 1, {}, "0" * 16))
    write_observed_cohort(folder, ("S", "T"))
    return {name: folder / f"{name}.h5" for name in ("null", "noise", "S", "T")} | {
        "estimator": folder / "flow.pt"
    }


def settings() -> stage.AnswerSettings:
    rule = BASE.misspecification
    model = case.MODEL.to_plain()
    summary = BASE.summary.to_plain()
    return stage.AnswerSettings.from_plain(
        {
            "exact_posterior": {"model": model, "exact": EXACT.to_plain()},
            "predictive_speeds": {
                "model": model,
                "summary": summary,
                "predictive": BASE.predictive.to_plain() | {"draws": 50},
            },
            "verdict": {
                "model": model,
                "rule": rule.rule.to_plain(),
                "ejection_time": rule.ejection_time.to_plain(),
                "lvet_sd_ms": 10.0,
            },
            "uninformative": {"sd_ratio": 0.9, "shift": 0.25},
        }
    )


def answer(study: dict[str, Path], folder: Path, subjects: tuple[str, ...]) -> dict[str, tuple[bytes, ...]]:
    made = {
        subject: [folder / f"{subject}-{name}" for name in ("posterior.h5", "verdict.json", "predictive.h5")]
        for subject in subjects
    }
    for subject, (posterior, verdict, predictive) in made.items():
        stage.population_answers(
            observation=study[subject],
            noise=study["noise"], estimator=study["estimator"], null=study["null"],
            posterior=posterior, verdict=verdict, predictive=predictive,
            settings=settings(), origin=Origin(1, subject, "c"),
        )  # fmt: skip
    return {subject: tuple(path.read_bytes() for path in paths) for subject, paths in made.items()}


@pytest.mark.slow
def test_each_subject_is_answered_whoever_was_answered_before(study: dict[str, Path], tmp_path: Path) -> None:
    both = answer(study, tmp_path, ("S", "T"))
    (tmp_path / "alone").mkdir()
    assert answer(study, tmp_path / "alone", ("T",))["T"] == both["T"]
    verdict = read_verdict(tmp_path / "T-verdict.json")
    assert verdict.status in {"not contradicted", "strained", "contradicted"}
    tested = [test.name for test in verdict.tests if not test.name.startswith(CONTRACTION)]
    assert tested[-1] == "network"
    assert len(tested) < len(verdict.tests)
    assert read_exact_posterior(tmp_path / "T-posterior.h5").phi.shape == (EXACT.draws, 4)
    assert load(tmp_path / "T-posterior.h5", "posterior")[1].subject == "T"
    assert both["S"] != both["T"]


def test_the_network_of_a_cohort_is_no_null_of_a_population(study: dict[str, Path]) -> None:
    with pytest.raises(ArtefactError, match="holds a 'noise' artefact, expected 'population_null'"):
        read_nulls(study["noise"])
