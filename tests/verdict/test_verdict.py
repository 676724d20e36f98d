"""Verdicts: well-specified recordings pass at the level, planted misfits are flagged by their tests."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import speed_case
from misspecification_case import Bank, conditioning, settings, subject_checks
from posterior_case import exact_of
from scipy.stats import kstest

from swesbi.artefacts import ArtefactError, Provenance, save, write_json
from swesbi.networks.flow.conditioning import raw_features
from swesbi.parameters import TOLD_NAMES
from swesbi.recording.observation import contexts_dataset
from swesbi.study.stages.verdict import _others
from swesbi.verdict.nulls import Grade, Reference
from swesbi.verdict.power import COHORT, STRAINED_OR_WORSE, alarm_rows
from swesbi.verdict.recordings import KIND, VOLUNTEER, SubjectChecks, read_subject_checks, to_groups
from swesbi.verdict.statistics import GROUPS, TEST_NAMES, WITH_STRIPS, Checks, no_checks
from swesbi.verdict.verdict import Status, Verdict, VerdictTest, read_verdict
from swesbi.verdict.with_null import grade, make_verdict, null_tests

NULL_RECORDINGS = 400
TOLD = {name: np.array([1.0, 2.0, np.nan, 3.0]) for name in TOLD_NAMES}


@pytest.fixture(scope="module")
def bank() -> Bank:
    return Bank()


@pytest.fixture(scope="module")
def subject(bank: Bank) -> SubjectChecks:
    null = bank.check(bank.recordings(NULL_RECORDINGS, 2), 1000)
    fresh = bank.check(bank.recordings(150, 3), 2000)
    reference = bank.recordings(2000, 4)
    features = raw_features(reference, bank.model.recording.phase, conditioning())
    return subject_checks(null, fresh, features)


@pytest.fixture(scope="module")
def reference(subject: SubjectChecks) -> Reference:
    return subject.reference(settings().rule)


def test_p_values_of_fresh_recordings_are_uniform(subject: SubjectChecks, reference: Reference) -> None:
    judged = reference.judge(subject.recordings["own"])
    for name, p in zip(TEST_NAMES, judged.test_p.T, strict=True):
        if name != "boundary_mass":  # most recordings have no mass at any bound: p = 1
            assert kstest(p, "uniform").pvalue > 0.01, name
    assert kstest(judged.group_p[:, 1], "uniform").pvalue > 0.01
    assert (judged.status > 0).mean() < 0.10


def test_noise_larger_than_stated_is_caught_by_the_fit(bank: Bank, reference: Reference) -> None:
    judged = reference.judge(bank.check(bank.recordings(40, 5, noise=2.0), 3000))
    assert (judged.status >= Grade.STRAINED).mean() > 0.8
    chi2 = TEST_NAMES.index("chi2")
    assert (judged.test_p[:, chi2] <= reference.joint.thresholds(0.05)[chi2]).mean() > 0.6


def test_a_curve_that_no_theta_gives_contradicts_the_model(bank: Bank, reference: Reference) -> None:
    """A second wave in diastole as high as the first: not in the prior, not in the fit."""
    speeds = bank.recordings(20, 7)
    speeds = np.maximum(speeds, np.roll(speeds, 10, axis=1))
    judged = reference.judge(bank.check(speeds, 4000))
    assert (judged.status == Grade.CONTRADICTED).mean() >= 0.9
    assert (judged.status >= Grade.STRAINED).mean() >= 0.95
    assert (judged.group_p[:, GROUPS.index("prior predictive")] <= 0.02).mean() > 0.8
    features = TEST_NAMES.index("conditional_features")
    assert (judged.test_p[:, features] <= reference.joint.thresholds(0.05)[features]).mean() > 0.5


def test_mass_at_a_rare_bound_is_caught_by_the_boundary_test_alone(
    subject: SubjectChecks, reference: Reference
) -> None:
    usual = subject.recordings["own"]
    quiet = np.flatnonzero(reference.judge(usual).overall_p > 0.5)[0]
    one = Checks(**{f.name: getattr(usual, f.name)[[quiet]].copy() for f in fields(Checks)})
    mass = np.zeros((1, len(WITH_STRIPS), 2))
    mass[0, WITH_STRIPS.index("k_atp_per_s"), 1] = 0.9
    pressed = replace(one, bound_mass=mass)
    judged = reference.judge(pressed)
    assert judged.status[0] == Grade.CONTRADICTED
    flagged = [test for test in null_tests(reference, pressed, judged) if test.flagged]
    assert [test.name for test in flagged] == ["boundary_mass"]
    assert "upper bound of k_atp_per_s" in flagged[0].detail


def test_a_feature_moved_alone_is_named(subject: SubjectChecks, reference: Reference) -> None:
    usual = subject.recordings["own"]
    tails = np.full((1, usual.tails.shape[1]), 0.5)
    tails[0, subject.feature_names.index("half_relaxation_time_cycle")] = 1.0
    one = Checks(**{f.name: getattr(usual, f.name)[[0]] for f in fields(Checks)})
    moved = replace(one, tails=tails)
    found = {t.name: t for t in null_tests(reference, moved, reference.judge(moved))}["conditional_features"]
    assert found.detail.startswith("least likely given the recording: half_relaxation_time_cycle (P 1.000)")


def test_the_file_gives_the_same_verdicts(
    subject: SubjectChecks, reference: Reference, tmp_path: Path
) -> None:
    path = tmp_path / "misspecification.h5"
    without = {**subject.recordings, VOLUNTEER: no_checks(len(subject.feature_names))}
    save(path, to_groups(replace(subject, recordings=without)), Provenance(KIND, "T"))
    read = read_subject_checks(path)
    assert read.subject == "T"
    assert len(read.recordings[VOLUNTEER]) == 0
    assert read.refused == subject.refused
    own = subject.recordings["own"]
    again = read.reference(settings().rule).judge(read.recordings["own"])
    assert np.array_equal(again.overall_p, reference.judge(own).overall_p)


def test_alarms_are_counted_once_for_each_recording(subject: SubjectChecks, reference: Reference) -> None:
    rows = {(r.subject, r.recordings, r.alarm): r for r in alarm_rows([subject, subject], settings().rule)}
    status = reference.judge(subject.recordings["own"]).status
    alone, cohort = rows["T", "own", STRAINED_OR_WORSE], rows[COHORT, "own", STRAINED_OR_WORSE]
    assert alone.rate == (status >= 1).mean()
    assert alone.ci_low <= alone.rate <= alone.ci_high
    assert cohort.n == 2 * alone.n
    assert rows[COHORT, "acquired", Status.CONTRADICTED].refused == 4
    assert (COHORT, VOLUNTEER, Status.CONTRADICTED) not in rows
    groups = [rows["T", "own", f"group: {g}"].rate for g in ("prior predictive", "fit", "bounds")]
    assert max(groups) <= alone.rate + 1e-9
    assert sum(groups) >= alone.rate - 0.01


def volume(z: float) -> VerdictTest:
    return VerdictTest("end_systolic_volume", z, None, 3.0, abs(z) > 3.0, "")


def ranges(outside: int) -> VerdictTest:
    return VerdictTest("context_ranges", float(outside), None, 0.0, outside > 0, "")


@pytest.mark.parametrize(
    ("overall", "z", "outside", "expected"),
    [
        (Grade.NOT_CONTRADICTED, -2.9, 0, Grade.NOT_CONTRADICTED),
        (Grade.NOT_CONTRADICTED, -3.1, 0, Grade.STRAINED),
        (Grade.NOT_CONTRADICTED, 6.1, 0, Grade.CONTRADICTED),
        (Grade.NOT_CONTRADICTED, 0.0, 1, Grade.STRAINED),
        (Grade.CONTRADICTED, 3.1, 1, Grade.CONTRADICTED),
        (Grade.STRAINED, 0.0, 0, Grade.STRAINED),
    ],
)
def test_volumes_and_context_strain_and_only_extreme_volumes_do_more(
    overall: Grade, z: float, outside: int, expected: Grade
) -> None:
    assert grade(overall, [volume(z)], [ranges(outside)], 6.0) == expected


MADE = exact_of(
    np.tile([61.0, 6.1, 29.1, 2.1], (50, 1)),
    np.tile([60.0, 6.0, 29.0, 2.2], (50, 1)),
    sampler="mcmc", k_hat=np.inf, efficiency=0.03, converged=False,
    reasons=("MCMC has not converged",),
)  # fmt: skip

FARTHEST = (3.4, "ivsd_cm")


def test_the_file_holds_a_graded_verdict(tmp_path: Path) -> None:
    test = VerdictTest("chi2", 3.2, 0.001, 0.004, True, "posterior predictive p-value of chi2 = 0.004")
    verdict = make_verdict(Grade.STRAINED, 0.02, (volume(3.3), test, ranges(0)), MADE, FARTHEST, TOLD)
    path = tmp_path / "verdict.json"
    write_json(path, verdict.to_json())
    assert read_verdict(path) == verdict
    assert list(verdict.answer) == list(TOLD_NAMES)
    assert verdict.answer["duration_ms"]["median"] == 2.0, "a draw without a beat tells nothing"
    assert verdict.sentence.endswith("; also end systolic volume; overall p = 0.02")
    assert verdict.may_be_read
    assert verdict.worst_component == "ivsd_cm"
    assert verdict.k_hat is None
    assert verdict.acceptance == 1.0
    assert verdict.reasons[-1] == "MCMC has not converged"
    assert verdict.sentence.startswith("strained: chi2: posterior predictive p-value")
    assert not make_verdict(Grade.CONTRADICTED, 0.0, (test,), MADE, FARTHEST, TOLD).may_be_read


def test_the_file_of_an_experiment_on_features_has_no_grading(tmp_path: Path) -> None:
    old = Verdict(2.0, "maximum_kpa", 900, 1000, {"k0_kpa": 50.0}, "prior-supported", "so it is", ())
    assert list(old.to_json()) == [
        "status",
        "sentence",
        "reasons",
        "max_abs_z",
        "worst_component",
        "in_prior_draws",
        "candidate_draws",
        "acceptance",
        "unfiltered_median",
    ]
    write_json(tmp_path / "verdict.json", old.to_json())
    assert read_verdict(tmp_path / "verdict.json") == old


def test_a_subject_is_compared_with_the_others_of_the_cohort(tmp_path: Path) -> None:
    cohort = [replace(speed_case.model().recording.context, subject=name) for name in "ABC"]
    path = tmp_path / "contexts.h5"
    save(path, contexts_dataset(cohort), Provenance("contexts"))
    assert _others(path, "B") == [cohort[0], cohort[2]]
    with pytest.raises(ArtefactError, match="context of subject X; it holds those of A, B, C"):
        _others(path, "X")
