"""From recordings of single subjects to the calibration of the cohort, its tables and its figure."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import speed_case
from calibration_case import JUDGEMENT, Sampler, prior_variances, simulate
from comparison_case import observation
from figure_text import assert_text_apart
from study_copy import ROOT

from swesbi.artefacts import Provenance
from swesbi.base.arrays import rows_of
from swesbi.checks.calibration.dataset import (
    Calibration,
    CalibrationLocal,
    CalibrationRecordings,
    Diagnostics,
    FreshRecordings,
    InferredRecordings,
    TwoSamples,
)
from swesbi.checks.calibration.known import acquisition_of
from swesbi.checks.calibration.ranks import QUANTITY_NAMES, RankedRecordings
from swesbi.checks.calibration.scores import CohortCalibration, by_stratum, calibration_of_cohort
from swesbi.checks.calibration.table import DOUBTFUL_OR_WORSE, POOLED
from swesbi.config.read import ConfigError, parse_config, read_merged
from swesbi.recording.settings import ACQUISITION
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.calibration import draw_calibration
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.nulls import WITH_STRIPS, Misfits

SUBJECTS = ("A", "B")
RECORDINGS = 120
SURPRISING = 30


def ranked(subject: str, network: Sampler, seed: int) -> RankedRecordings:
    scores, weighted = (simulate(RECORDINGS, sampler, 99, seed) for sampler in (network, Sampler()))
    return RankedRecordings(
        names=QUANTITY_NAMES,
        subject=np.full(RECORDINGS, subject),
        truth=np.ones((RECORDINGS, len(QUANTITY_NAMES))),
        prior_variance=prior_variances(RECORDINGS),
        network=scores,
        weighted=weighted,
    )


def diagnostics() -> Diagnostics:
    rng = np.random.default_rng(1)
    return Diagnostics(
        k_hat=rng.uniform(0.0, 0.8, RECORDINGS),
        efficiency=rng.uniform(0.3, 0.9, RECORDINGS),
        log_evidence=rng.normal(size=RECORDINGS),
        by_mcmc=np.arange(RECORDINGS) == 0,
    )


def misfits(surprising: int = 0) -> Misfits:
    """What the verdict sees in well-specified recordings, and in some whose residuals no heart makes."""
    rng = np.random.default_rng(2)
    p = rng.beta(2.0, 2.0, RECORDINGS)
    p[:surprising] = 1e-9
    ratio = rng.gamma(0.3, 1.0 / 0.3, (RECORDINGS, len(WITH_STRIPS), 2))
    return Misfits(np.full(RECORDINGS, 19), np.full(RECORDINGS, 0.03), np.zeros(RECORDINGS), p, ratio)


@pytest.fixture(scope="module")
def results() -> CohortCalibration:
    """Of two subjects; the network's posteriors are too narrow."""
    narrow, recordings, local_parts = Sampler(noise_factor=0.6), [], []
    for index, subject in enumerate(SUBJECTS):
        own, acquired = (
            InferredRecordings(ranked(subject, narrow, seed), diagnostics(), misfits(SURPRISING))
            for seed in (10 * index, 10 * index + 1)
        )
        recordings.append(CalibrationRecordings(own, acquired))
        accuracy, draws = np.array([[0.6, 0.51, np.nan]]), np.full((1, 3), 5000.0)
        pairs = ("proposal mcmc", "weighted mcmc", "proposal weighted")
        local = ranked(subject, Sampler(), 30 + index)
        local_parts.append(CalibrationLocal(local, TwoSamples((subject,), pairs, accuracy, draws)))
    context = speed_case.model().recording.context
    hearts = tuple(replace(context, subject=f"H{number}") for number in range(RECORDINGS))
    return calibration_of_cohort(
        tuple(recordings),
        tuple(local_parts),
        NullRecordings(hearts, misfits(), misfits()),
        judgement=JUDGEMENT,
        rule=speed_case.rule(),
    )


def test_recordings_of_all_subjects_are_kept_in_their_order(
    results: CohortCalibration, tmp_path: Path
) -> None:
    results.calibration.write(tmp_path / "calibration.h5", Provenance(""))
    read = Calibration.read(tmp_path / "calibration.h5")
    assert read.two_samples.subject == SUBJECTS
    of_second = rows_of(read.model_noise.ranked, read.model_noise.ranked.subject == "B")
    second = ranked("B", Sampler(noise_factor=0.6), 10)
    np.testing.assert_array_equal(of_second.network.level, second.network.level)
    np.testing.assert_array_equal(of_second.weighted.tarp, second.weighted.tarp)
    np.testing.assert_array_equal(read.model_noise.diagnostics.k_hat[RECORDINGS:], diagnostics().k_hat)


def test_a_subject_without_long_chains_is_not_compared_with_them() -> None:
    both, one = ("proposal mcmc", "weighted mcmc", "proposal weighted"), ("proposal weighted",)
    with_chains = TwoSamples(("A",), both, np.array([[0.6, 0.5, 0.7]]), np.full((1, 3), 50.0))
    without = TwoSamples(("B",), one, np.array([[0.8]]), np.full((1, 1), 50.0))
    joined = TwoSamples.joined([with_chains, without])
    assert (joined.subject, joined.pair) == (("A", "B"), tuple(sorted(both)))
    np.testing.assert_array_equal(joined.accuracy, [[0.6, 0.7, 0.5], [np.nan, 0.8, np.nan]])
    np.testing.assert_array_equal(np.isnan(joined.draws), np.isnan(joined.accuracy))


def test_recovery_is_that_of_the_weighted_posterior(results: CohortCalibration) -> None:
    whole = results.calibration
    for table, of in (
        (results.recovery, whole.model_noise),
        (results.recovery_acquisition, whole.sample_by_sample),
    ):
        assert len(table) == 3 * len(JUDGEMENT.nominal_levels)
        assert (table["n"] == 2 * RECORDINGS).all()
        level = of.ranked.weighted.level
        covered = np.abs(2.0 * level[:, 2] - 1.0) <= 0.9
        row = table[(table["parameter"] == "k_sr_per_s") & (table["nominal"] == 0.9)]
        assert row["coverage"].item() == pytest.approx(covered.mean())


def test_a_stratum_counts_its_own_recordings_alone() -> None:
    inferred = InferredRecordings(ranked("A", Sampler(noise_factor=0.6), 3), diagnostics(), misfits())
    context = speed_case.model().recording.context
    fresh = FreshRecordings((context,) * RECORDINGS, np.full(RECORDINGS, 0.03), inferred, 0)
    first, raised = np.arange(RECORDINGS) < 40, np.arange(RECORDINGS) < 10
    strata = {"first": first, "nobody": np.zeros(RECORDINGS, dtype=bool)}
    table = by_stratum(fresh, strata, {DOUBTFUL_OR_WORSE: raised}, JUDGEMENT)
    assert set(table["stratum"]) == {"all", "first"}
    named = table.set_index(["sampler", "stratum", "parameter", "nominal"])
    for sampler, scores in (("proposal", inferred.ranked.network), ("weighted", inferred.ranked.weighted)):
        row = named.loc[(sampler, "first", "k_sr_per_s", 0.9)]
        inside = np.abs(2.0 * scores.level[first, 2] - 1.0) <= 0.9
        assert row["coverage"] == pytest.approx(inside.mean())
        assert row["bias"] == pytest.approx(scores.mean[first, 2].mean() - 1.0)
        assert (row["n"], row["false_alarms"]) == (40, 0.25)
        assert row["median_efficiency"] == np.median(inferred.diagnostics.efficiency[first])


def test_alarms_are_counted_by_test_and_kind_of_recordings(results: CohortCalibration) -> None:
    table = results.alarms.set_index(["recordings", "alarm"])
    assert set(table["n"]) == {2 * RECORDINGS}
    for kind in ("model_noise", "sample_by_sample"):
        rate = table.loc[kind, "rate"]
        assert rate["residuals"] == pytest.approx(SURPRISING / RECORDINGS, abs=0.04)
        assert rate["boundary_mass"] < 0.06
        assert rate["contradicted"] <= rate["doubtful or contradicted"] <= rate[:2].sum()
        assert (table.loc[kind, "ci_low"] <= rate).all() and (rate <= table.loc[kind, "ci_high"]).all()


def test_the_table_flags_the_narrow_network_alone(results: CohortCalibration) -> None:
    table = results.table
    pooled = table[(table["subject"] == POOLED) & (table["recordings"] == "model_noise")]
    narrow = pooled[(pooled["sampler"] == "proposal") & (pooled["test"] == "coverage")]
    assert narrow["flagged"].sum() >= 3
    assert pooled[pooled["sampler"] == "weighted"]["flagged"].sum() == 0
    assert (pooled["n"] == 2 * RECORDINGS).all()


def test_limits_are_shared_and_a_second_recording_need_only_contract_some(results: CohortCalibration) -> None:
    table = results.table
    sbc = table[table["test"] == "sbc"]
    pooled = sbc["subject"] == POOLED
    assert sbc[pooled]["limit"].unique() == pytest.approx([0.05 / 6])
    assert sbc[~pooled]["limit"].unique() == pytest.approx([0.05 / 12])
    assert not ((table["recordings"] == "local") & (table["subject"] == POOLED)).any()
    least = table[table["test"] == "contraction"].groupby("recordings")["limit"].agg(["min", "max"])
    assert least.loc["local"].tolist() == [0.0, 0.0]
    assert (least.drop("local") == 0.2).all(axis=None)


def test_a_classifier_that_finds_a_difference_or_nothing_is_flagged(results: CohortCalibration) -> None:
    c2st = results.table[results.table["test"] == "c2st"].set_index(["subject", "sampler"])["flagged"]
    for subject in SUBJECTS:
        assert c2st.loc[subject].to_dict() == {"proposal mcmc": 1, "weighted mcmc": 0, "proposal weighted": 1}


@pytest.mark.parametrize(
    ("key", "value", "number"), [("replicates", 3000, 6000), ("two_sample_draws", 5001, 5001)]
)
def test_more_draws_than_a_posterior_keeps_are_refused(key: str, value: int, number: int) -> None:
    plain = copy.deepcopy(read_merged(ROOT / "config.yaml"))
    local = plain["experiments"]["calibrated"]["calibration"]["local"]
    local[key] = value
    local["mcmc"]["min_effective_draws"] = 6000
    with pytest.raises(ConfigError, match=rf"local\.{key} is {number}, but only 5000 .*exact\.draws"):
        parse_config(plain)


def test_coverage_of_all_recordings_is_drawn_with_an_interval(results: CohortCalibration) -> None:
    """Of n recordings that are all covered the interval reaches down to a^(1/n), with a half of the rest."""
    figure = draw_calibration(
        results.calibration,
        results.table.assign(coverage_90=1.0),
        judgement=JUDGEMENT.model_copy(update={"confidence": 0.8}),
        max_k_hat=0.7,
        experiment="calibrated",
        cohort_title="virtual volunteers",
    )
    assert_text_apart(figure)
    lines = [line for part in figure.axes[1].collections for line in part.get_segments()]
    lowest = 0.1 ** (1.0 / (2 * RECORDINGS))
    np.testing.assert_allclose([line[:, 0] for line in lines], [[lowest, 1.0]] * len(lines))
    assert len(lines) == 4 * (1 + len(QUANTITY_NAMES))


def test_recordings_like_a_subject_s_have_the_errors_of_its_group() -> None:
    """Those of ``acquisition`` are another laboratory's: errors told by the group would be wrong for them."""
    config, quiet = speed_case.shipped(), NoiseComponents(0.004, 0.06, 0.002)
    found = acquisition_of(observation("A"), quiet, ACQUISITION, config.recording, config.measurement)
    made = found.settings
    assert (made.repeat_sd_fraction, made.sample_sd_fraction, made.sweep_fraction) == (0.004, 0.06, 0.002)
    assert found.noise is quiet and made.missing_phases == (7,)
    assert made.failed_fraction == ACQUISITION.failed_fraction
