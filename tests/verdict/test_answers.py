from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import population_case as case
import pytest
import speed_case
from exact_case import SMALL
from recordings import RECORDING, levels_of, make_samples

from swesbi.answers.answer import AnswerOfPopulation, answer_of_population
from swesbi.artefacts import ArtefactError, Provenance
from swesbi.artefacts.typed import read_as
from swesbi.checks.calibration.dataset import FreshRecordings, PopulationCalibration
from swesbi.checks.calibration.known import infer_all, of_fresh
from swesbi.checks.calibration.scores import strata_of
from swesbi.checks.settings import RecordingsSettings
from swesbi.context import Context
from swesbi.networks.flow.conditioning import CellConditioner
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE, fresh_subject, record_fresh, recorded
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, fit_cohort
from swesbi.recording.observation import Observation
from swesbi.verdict.context import declared_refusal
from swesbi.verdict.contraction import CONTRACTION
from swesbi.verdict.null_recordings import NullRecordings, null_recordings
from swesbi.verdict.settings import UninformativeSettings

BASE = case.CONFIG.speed_experiments[case.EXPERIMENT.base]
EXACT = SMALL.model_copy(update={"draws": 400})
SIZES = RecordingsSettings(
    model_noise=1, sample_by_sample=1, network_draws=49, effective_draws=20, misfit_draws=20
)


@cache
def parts(start: int, stop: int, kind: str = MODEL_NOISE) -> FreshRecordings:
    flow = case.trained().estimator
    made = of_fresh(range(start, stop), kind, case.FRESH, seed=7)
    return infer_all(made, stop - start, kind, flow, SIZES, EXACT)


def test_the_network_of_a_population_is_kept_with_what_it_sees(tmp_path: Path) -> None:
    flow = case.trained().estimator
    flow.write(tmp_path / "flow.h5", Provenance("", "", 1, {}, "0" * 16))
    again = TrainedFlow.read(tmp_path / "flow.h5")
    assert isinstance(again.conditioner, CellConditioner)
    recording = fresh_subject(0, case.FRESH, 7, "a").model.recording
    assert np.array_equal(again.conditioner.condition(recording), flow.conditioner.condition(recording))
    assert again.components == flow.components


def test_a_fresh_context_depends_on_its_number_alone_and_was_not_trained_on() -> None:
    first, again = fresh_subject(5, case.FRESH, 7, "a"), fresh_subject(5, case.FRESH, 7, "a")
    context = first.model.recording.context
    assert context == again.model.recording.context
    assert context not in case.made().contexts
    assert context != fresh_subject(5, case.FRESH, 7, "b").model.recording.context
    low, high = case.EXPERIMENT.conditions.relative_se
    assert low < first.level < high


def test_a_recording_acquired_sample_by_sample_has_the_noise_and_phases_that_were_drawn() -> None:
    for number in range(4):
        subject = fresh_subject(number, case.FRESH, 7, "a")
        model = recorded(
            subject, record_fresh(subject, SAMPLE_BY_SAMPLE, case.FRESH, 7, "a", SAMPLE_BY_SAMPLE)
        )
        assert len(model.recording.phase) <= 20 - len(subject.missing)
        assert np.median(model.recording.relative_se) == pytest.approx(subject.level, rel=0.1)


@pytest.mark.slow
def test_parts_of_the_calibration_join_to_what_one_part_would_be(tmp_path: Path) -> None:
    for number, (start, stop) in enumerate(((0, 2), (2, 4))):
        part = PopulationCalibration(*(parts(start, stop, kind) for kind in (MODEL_NOISE, SAMPLE_BY_SAMPLE)))
        part.write(tmp_path / f"part-{number}.h5", Provenance("", "", 1, {}, "0" * 16))
    files = [tmp_path / "part-0.h5", tmp_path / "part-1.h5"]
    joined = read_as(PopulationCalibration, files, "parts").model_noise
    whole = parts(0, 4)
    assert joined.contexts == whole.contexts
    assert np.array_equal(joined.relative_se, whole.relative_se)
    for name in ("level", "mean", "sd"):
        found, expected = (getattr(one.inferred.ranked.weighted, name) for one in (joined, whole))
        assert np.array_equal(found, expected), name


def test_strata_of_a_value_are_a_partition_with_the_cuts_where_they_are_said() -> None:
    """Hypertrophied and dilated hearts are strata of their own."""
    ages = [8.0, 17.9, 18.0, 39.0, 40.0, 70.0]
    hearts = [(90.0, 0.8), (100.0, 1.5), (220.0, 0.9)] * 2
    contexts = [
        Context("T", "F" if n % 2 else "M", age, 1.7, 66.0, lvedv, 0.4 * lvedv, ivsd)
        for n, (age, (lvedv, ivsd)) in enumerate(zip(ages, hearts, strict=True))
    ]
    found = strata_of(contexts, np.full(6, 0.03), case.EXPERIMENT.calibration.strata)
    by_age = {name: part for name, part in found.items() if name.startswith("age")}
    assert np.array_equal(np.sum(list(by_age.values()), axis=0), np.ones(6))
    assert by_age["age_years below 18"].tolist() == [True, True, False, False, False, False]
    assert by_age["age_years 63 and more"].tolist() == [False] * 5 + [True]
    assert found["sex F"].sum() == 3
    assert found["ivsd_cm 1.2 and more"].tolist() == [False, True, False] * 2
    assert found["lvedv_ml 160 and more"].tolist() == [False, False, True] * 2


def drawn_nulls(gated: int, pushes: int) -> NullRecordings:
    changes = {"recordings": gated, "free_running_recordings": pushes, "effective_draws": 20}
    sizes = case.EXPERIMENT.nulls.model_copy(update=changes)
    flow = case.trained().estimator
    return null_recordings(flow, fresh=case.FRESH, null_sizes=sizes, exact=EXACT, seed=7)


def test_null_recordings_are_kept_and_do_not_depend_on_how_many_there_are(tmp_path: Path) -> None:
    null, fewer = drawn_nulls(6, 5), drawn_nulls(3, 3)
    null.write(tmp_path / "null.h5", Provenance("", "", 1, {}, "0" * 16))
    read = NullRecordings.read(tmp_path / "null.h5")
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


def answer(folder: Path, subject: str) -> AnswerOfPopulation:
    misspecification = BASE.misspecification
    return answer_of_population(
        Observation.read(folder / f"{subject}.h5"),
        CohortNoise.read(folder / "noise.h5"),
        case.trained().estimator,
        drawn_nulls(20, 5),
        model=case.MODEL,
        exact=EXACT,
        summary=BASE.summary,
        predictive=BASE.predictive.model_copy(update={"draws": 50}),
        rule=misspecification.rule,
        ejection_time=misspecification.ejection_time,
        lvet_sd_ms=10.0,
        uninformative=UninformativeSettings(sd_ratio=0.9, shift=0.25),
        cuff=None,
        seed=1,
    )


def write_observed_cohort(folder: Path, subjects: Sequence[str]) -> None:
    """Write ``<subject>.h5`` of each subject, recorded with noise of its own, and ``noise.h5``."""
    speeds = speed_case.model().recording.speed_m_s
    levels = {}
    for seed, subject in enumerate(subjects):
        samples = make_samples(speeds, repeat_sd=0.04, sample_sd=0.08, seed=seed)
        context = replace(speed_case.CONTEXT, subject=subject)
        observed = ingest(samples, context, RECORDING, 100)
        observed.write(folder / f"{subject}.h5", Provenance("", subject, 1, {}, "c"))
        levels[subject] = levels_of(samples)
    fit_cohort(levels, {}).write(folder / "noise.h5", Provenance("", "", 1, {}, "c"))


@pytest.mark.slow
def test_each_subject_is_answered_whoever_was_answered_before(tmp_path: Path) -> None:
    write_observed_cohort(tmp_path, ("S", "T"))
    first, found, alone = (answer(tmp_path, subject) for subject in "STT")
    assert found.with_pressures is None
    files = {name: made for name, made in found._asdict().items() if made is not None}
    for name, made in files.items():
        paths = [tmp_path / f"{name} {number}" for number in range(2)]
        for path, one in zip(paths, (made, getattr(alone, name)), strict=True):
            one.write(path, Provenance("", "T"))
        assert paths[0].read_bytes() == paths[1].read_bytes(), name
    assert found.verdict.status in {"not contradicted", "doubtful", "contradicted"}
    tested = [test.name for test in found.verdict.tests if not test.name.startswith(CONTRACTION)]
    assert tested[-1] == "network"
    assert len(tested) < len(found.verdict.tests)
    assert found.posterior.phi.shape == (EXACT.draws, 4)
    assert not np.array_equal(first.posterior.phi, found.posterior.phi)


def test_the_network_of_a_cohort_is_no_null_of_a_population(tmp_path: Path) -> None:
    write_observed_cohort(tmp_path, ("S",))
    with pytest.raises(ArtefactError, match="holds a 'noise' artefact, expected 'population_null'"):
        NullRecordings.read(tmp_path / "noise.h5")
