from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import speed_case
from posterior_case import exact_of
from scipy.stats import kstest

from swesbi.artefacts import ArtefactError, Provenance
from swesbi.base.arrays import FloatArray, below_each_other
from swesbi.measurement.likelihood import draw_speeds, log_likelihood
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.parameters import REPORTED_NAMES
from swesbi.prior import quantile
from swesbi.recording.observation import Contexts
from swesbi.verdict.nulls import TESTS, Grade, Misfits, misfits_of, overall_p, p_values, single_level
from swesbi.verdict.recording import grade, make_verdict, others_than
from swesbi.verdict.summary import verdict_numbers, weights_in_words
from swesbi.verdict.verdict import Status, Verdict, VerdictTest

RULE = speed_case.rule()
NULL_RECORDINGS = 400
TOLD = {name: np.array([1.0, 2.0, np.nan, 3.0]) for name in REPORTED_NAMES}

BANK = 6000
DRAWS = 200
RELATIVE_SE = 0.12


class Bank:
    """Prior simulations, simulated once, weighted to the posterior of any recording.

    The recordings are noisier than real ones, so that many simulations share the posterior.
    """

    def __init__(self) -> None:
        quiet = speed_case.model()
        recording = replace(quiet.recording, relative_se=np.full(len(quiet.recording.phase), RELATIVE_SE))
        self.model = replace(quiet, recording=recording)
        self.phi, self.predicted = self._simulate(BANK, 1)

    def clean(self, count: int, seed: int) -> PredictedSpeeds:
        """Return noiseless speeds of phi from the prior that are not in the bank."""
        return self._simulate(count, seed)[1]

    def recordings(self, count: int, seed: int, noise: float = 1.0) -> FloatArray:
        """Draw speeds (count, p) of recordings, well-specified if ``noise`` is one."""
        clean, rng = self.clean(count, seed), np.random.default_rng(seed + 1)
        noisy = draw_speeds(clean, self.model.recording.errors, self.model.settings.discrepancy, rng)
        return np.asarray(np.exp(clean.log_speed + noise * (np.log(noisy) - clean.log_speed)))

    def _simulate(self, count: int, seed: int) -> tuple[FloatArray, PredictedSpeeds]:
        phi = quantile(np.random.default_rng(seed).random((count, 4)), self.model.settings.prior)
        return phi, self.model.predict(phi)

    def check(self, speeds: FloatArray, seed: int) -> Misfits:
        """Check recordings (n, p) under posteriors from all simulations, weighted by the exact likelihood."""
        return below_each_other([self._check(row, seed + i) for i, row in enumerate(speeds)])

    def _check(self, speeds: FloatArray, seed: int) -> Misfits:
        model = replace(self.model, recording=replace(self.model.recording, speed_m_s=speeds))
        log_weight = log_likelihood(self.predicted, model.recording, model.settings.discrepancy)
        weight = np.exp(log_weight - log_weight.max())
        rows = np.random.default_rng(seed).choice(len(weight), DRAWS, p=weight / weight.sum())
        weights, rng = np.full(DRAWS, 1 / DRAWS), np.random.default_rng(seed)
        return misfits_of(model, self.phi[rows], weights, self.predicted.rows(rows), rng)


@pytest.fixture(scope="module")
def bank() -> Bank:
    return Bank()


@pytest.fixture(scope="module")
def null(bank: Bank) -> Misfits:
    return bank.check(bank.recordings(NULL_RECORDINGS, 2), 1000)


def test_p_values_of_fresh_recordings_are_uniform(bank: Bank, null: Misfits) -> None:
    p = p_values(null, bank.check(bank.recordings(150, 3), 2000), RULE)
    assert all(kstest(column, "uniform").pvalue > 0.01 for column in p.T)
    assert (overall_p(p) <= RULE.doubtful_level).mean() < 0.10


def test_noise_larger_than_stated_is_caught_by_the_residuals(bank: Bank, null: Misfits) -> None:
    p = p_values(null, bank.check(bank.recordings(40, 5, noise=2.0), 3000), RULE)
    assert (overall_p(p) <= RULE.doubtful_level).mean() > 0.8
    assert (p[:, TESTS.index("residuals")] <= single_level(RULE.doubtful_level)).mean() > 0.8


def test_a_curve_that_no_theta_gives_contradicts_the_model(bank: Bank, null: Misfits) -> None:
    """A second wave in diastole as high as the first."""
    speeds = bank.recordings(20, 7)
    speeds = np.maximum(speeds, np.roll(speeds, 10, axis=1))
    overall = overall_p(p_values(null, bank.check(speeds, 4000), RULE))
    assert (overall <= RULE.contradicted_level).mean() >= 0.9
    assert (overall <= RULE.doubtful_level).mean() >= 0.95


def volume(z: float) -> VerdictTest:
    return VerdictTest("end_systolic_volume", z, None, 3.0, abs(z) > 3.0, "")


def ranges(outside: int) -> VerdictTest:
    return VerdictTest("context_ranges", float(outside), None, 0.0, outside > 0, "")


@pytest.mark.parametrize(
    ("overall", "z", "outside", "expected"),
    [
        (Grade.NOT_CONTRADICTED, -2.9, 0, Grade.NOT_CONTRADICTED),
        (Grade.NOT_CONTRADICTED, -3.1, 0, Grade.DOUBTFUL),
        (Grade.NOT_CONTRADICTED, 6.1, 0, Grade.CONTRADICTED),
        (Grade.NOT_CONTRADICTED, 0.0, 1, Grade.DOUBTFUL),
        (Grade.CONTRADICTED, 3.1, 1, Grade.CONTRADICTED),
        (Grade.DOUBTFUL, 0.0, 0, Grade.DOUBTFUL),
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
    test = VerdictTest("residuals", 3.2, 0.001, 0.004, True, "posterior predictive p-value 0.004")
    verdict = make_verdict(Grade.DOUBTFUL, 0.02, (volume(3.3), test, ranges(0)), MADE, FARTHEST, TOLD)
    path = tmp_path / "verdict.json"
    verdict.write(path, Provenance(""))
    assert Verdict.read(path) == verdict
    assert list(verdict.answer) == list(REPORTED_NAMES)
    assert verdict.answer["duration_ms"]["median"] == 2.0, "a draw without a beat tells nothing"
    assert verdict.sentence.endswith("; also end systolic volume; overall p = 0.02")
    assert verdict.may_be_read
    assert verdict.worst_component == "ivsd_cm"
    assert verdict.k_hat is None
    assert verdict.acceptance == 1.0
    assert verdict.reasons[-1] == "MCMC has not converged"
    assert verdict.sentence.startswith("doubtful: residuals: posterior predictive p-value")
    assert not make_verdict(Grade.CONTRADICTED, 0.0, (test,), MADE, FARTHEST, TOLD).may_be_read


def test_a_subject_is_compared_with_the_others_of_the_cohort() -> None:
    cohort = tuple(replace(speed_case.model().recording.context, subject=name) for name in "ABC")
    assert others_than("B", Contexts(cohort)) == [cohort[0], cohort[2]]
    with pytest.raises(ArtefactError, match="context of subject X; it holds those of A, B, C"):
        others_than("X", Contexts(cohort))


PLAIN = Verdict(1.8, "peak", 1, 10, {}, Status.PRIOR_SUPPORTED, "", ())


def flagged(**p: float | None) -> Verdict:
    """A verdict whose tests have these p-values and are flagged, beside one that is not."""
    tests = [VerdictTest(name, 4.0, value, 0.05, True, "") for name, value in p.items()]
    passed = VerdictTest("passed", 0.0, 0.0, 0.05, False, "")
    return replace(PLAIN, sampler="importance", tests=(passed, *tests))


def test_flagged_tests_stand_by_how_strongly_they_speak_and_one_more_is_not_worth_a_count() -> None:
    four = {"weak": 0.04, "edge": 0.001, "strong": 0.0009, "end_systolic_volume": None}
    shown = ("end systolic volume", "strong, p < 0.001", "edge, p = 0.001", "weak, p = 0.040")
    assert verdict_numbers(flagged(**four), 3) == shown
    assert verdict_numbers(flagged(weakest=0.05, **four), 3) == (*shown[:3], "and 2 more")
    assert verdict_numbers(flagged()) == ()
    assert verdict_numbers(PLAIN) == ("1 in-prior draw", "max |z| = 1.80")


def test_weights_are_told_by_what_is_known_of_them() -> None:
    told = [
        weights_in_words(replace(PLAIN, k_hat=k_hat, efficiency=efficiency))
        for k_hat, efficiency in ((0.349, 0.808), (None, 0.02), (0.0, 0.0), (0.7, None))
    ]
    assert [re.findall(r"inf|[\d.]+", words) for words in told] == [
        ["0.35", "81"],
        ["inf", "2"],
        ["0.00", "0"],
        ["0.70"],
    ]
