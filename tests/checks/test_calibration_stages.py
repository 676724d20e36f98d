"""From parts of subjects to the joined artefact, the tables and the figure."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import speed_case
import xarray as xr
from calibration_case import PRIOR, Sampler, prior_variances, simulate
from comparison_case import CONFIG, observation
from study_copy import ROOT

from swesbi.artefacts import ArtefactError, Origin, Provenance, load, save
from swesbi.base.arrays import rows_of
from swesbi.checks.calibration.dataset import (
    KIND,
    LOCAL_KIND,
    RECORDINGS_KIND,
    diagnostics_of,
    ranked_of,
    recordings_dataset,
    two_samples_dataset,
)
from swesbi.checks.calibration.ranks import QUANTITY_NAMES, Diagnostics, Inferred, Ranked
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.checks.calibration.table import COLUMNS, POOLED
from swesbi.config.read import ConfigError, parse_config, read_merged
from swesbi.measurement.settings import MeasurementSettings
from swesbi.recording.acquisition_settings import ACQUISITION
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.study.stages import calibration, check_figures
from swesbi.study.stages.calibration import CalibrationStageSettings
from swesbi.study.stages.check_figures import CalibrationFigureSettings
from swesbi.study.stages.exact import acquisition_of
from swesbi.verdict.checks import WITH_STRIPS, Checks
from swesbi.verdict.null_recordings import KIND as NULL
from swesbi.verdict.null_recordings import NullRecordings, null_groups

SUBJECTS = ("A", "B")
RECORDINGS = 120
SURPRISING = 30
JUDGEMENT = JudgementSettings(
    alpha=0.05, least_contraction=0.2, max_c2st=0.53, nominal_levels=(0.5, 0.9), confidence=0.95
)


def ranked(subject: str, network: Sampler, seed: int) -> Ranked:
    scores, weighted = (simulate(RECORDINGS, sampler, 99, seed) for sampler in (network, Sampler()))
    return Ranked(
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


def checks(surprising: int = 0) -> Checks:
    """What the verdict sees in well-specified recordings, and in some whose residuals no heart makes."""
    rng = np.random.default_rng(2)
    p = rng.beta(2.0, 2.0, RECORDINGS)
    p[:surprising] = 1e-9
    ratio = rng.gamma(0.3, 1.0 / 0.3, (RECORDINGS, len(WITH_STRIPS), 2))
    return Checks(np.full(RECORDINGS, 19), np.full(RECORDINGS, 0.03), np.zeros(RECORDINGS), p, ratio)


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Path], list[Path]]:
    """Parts of two subjects; the network's posteriors are too narrow."""
    folder, narrow = tmp_path_factory.mktemp("parts"), Sampler(noise_factor=0.6)
    recordings, local_parts = [], []
    for index, subject in enumerate(SUBJECTS):
        groups = {
            name: recordings_dataset(
                Inferred(ranked(subject, narrow, 10 * index + shift), diagnostics(), checks(SURPRISING))
            )
            for shift, name in enumerate(("own", "acquired"))
        }
        recordings.append(folder / f"recordings-{subject}.h5")
        save(recordings[-1], groups, Provenance(RECORDINGS_KIND, subject))
        pairs = {"npe mcmc": 0.6, "weighted mcmc": 0.51, "npe weighted": float("nan")}
        groups = {
            "local": recordings_dataset(ranked(subject, Sampler(), 30 + index)),
            "two_samples": two_samples_dataset(subject, pairs, 5000),
        }
        local_parts.append(folder / f"local-{subject}.h5")
        save(local_parts[-1], groups, Provenance(LOCAL_KIND, subject))
    return recordings, local_parts


@pytest.fixture(scope="module")
def results(parts: tuple[list[Path], list[Path]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibration")
    null, context = folder / "null.h5", speed_case.model().recording.context
    hearts = tuple(replace(context, subject=f"H{number}") for number in range(RECORDINGS))
    save(null, null_groups(NullRecordings(hearts, checks(), checks())), Provenance(NULL))
    calibration.calibration(
        recordings=parts[0],
        local_parts=parts[1],
        null=null,
        alarms=folder / "alarms.csv",
        calibration=folder / "calibration.h5",
        table=folder / "calibration.csv",
        recovery=folder / "recovery.csv",
        recovery_acquisition=folder / "recovery_acquisition.csv",
        settings=CalibrationStageSettings(prior=PRIOR.theta, judgement=JUDGEMENT, rule=speed_case.rule()),
        origin=Origin(1),
    )
    return folder


def group(results: Path, name: str) -> xr.Dataset:
    return load(results / "calibration.h5", KIND, name)[0]


def test_the_parts_come_back_joined_and_unchanged(
    parts: tuple[list[Path], list[Path]], results: Path
) -> None:
    joined = ranked_of(group(results, "own"))
    assert joined.subject.tolist() == ["A"] * RECORDINGS + ["B"] * RECORDINGS
    second = ranked_of(load(parts[0][1], RECORDINGS_KIND, "own")[0])
    for name in ("level", "tarp", "mean", "sd"):
        for sampler in ("npe", "weighted"):
            of_both = getattr(rows_of(joined, joined.subject == "B").of(sampler), name)
            np.testing.assert_array_equal(of_both, getattr(second.of(sampler), name))
    found, made = diagnostics_of(group(results, "own")), diagnostics()
    np.testing.assert_array_equal(found.k_hat[:RECORDINGS], made.k_hat)
    assert found.by_mcmc.dtype == bool and found.by_mcmc.sum() == 2
    assert group(results, "two_samples")["subject"].to_numpy().tolist() == list(SUBJECTS)


def test_recovery_is_that_of_the_weighted_posterior(results: Path) -> None:
    for name, recordings in (("recovery", "own"), ("recovery_acquisition", "acquired")):
        table = pd.read_csv(results / f"{name}.csv")
        assert list(table.columns) == [
            "parameter", "nominal", "coverage", "ci_low", "ci_high", "n", "bias", "contraction",
        ]  # fmt: skip
        assert len(table) == 3 * len(JUDGEMENT.nominal_levels)
        assert (table["n"] == 2 * RECORDINGS).all()
        level = ranked_of(group(results, recordings)).weighted.level
        covered = np.abs(2.0 * level[:, 2] - 1.0) <= 0.9
        row = table[(table["parameter"] == "k_sr_per_s") & (table["nominal"] == 0.9)]
        assert row["coverage"].item() == pytest.approx(covered.mean())


def test_alarms_are_counted_by_test_and_kind_of_recordings(results: Path) -> None:
    table = pd.read_csv(results / "alarms.csv").set_index(["recordings", "alarm"])
    assert set(table["n"]) == {2 * RECORDINGS}
    for kind in ("own", "acquired"):
        rate = table.loc[kind, "rate"]
        assert rate["residuals"] == pytest.approx(SURPRISING / RECORDINGS, abs=0.04)
        assert rate["boundary_mass"] < 0.06
        assert rate["contradicted"] <= rate["strained or contradicted"] <= rate[:2].sum()
        assert (table.loc[kind, "ci_low"] <= rate).all() and (rate <= table.loc[kind, "ci_high"]).all()


def test_the_table_flags_the_narrow_network_and_not_the_weighted_posterior(results: Path) -> None:
    table = pd.read_csv(results / "calibration.csv")
    assert list(table.columns) == list(COLUMNS)
    pooled = table[(table["subject"] == POOLED) & (table["recordings"] == "own")]
    narrow = pooled[(pooled["sampler"] == "npe") & (pooled["test"] == "coverage")]
    assert narrow["flagged"].sum() >= 3
    assert pooled[pooled["sampler"] == "weighted"]["flagged"].sum() == 0
    assert (pooled["n"] == 2 * RECORDINGS).all()


def test_limits_are_shared_where_several_are_looked_at(results: Path) -> None:
    table = pd.read_csv(results / "calibration.csv")
    sbc = table[table["test"] == "sbc"]
    pooled = sbc["subject"] == POOLED
    assert sbc[pooled]["limit"].unique() == pytest.approx([0.05 / 6])
    assert sbc[~pooled]["limit"].unique() == pytest.approx([0.05 / 12])
    assert not ((table["recordings"] == "local") & (table["subject"] == POOLED)).any()


def test_contraction_by_a_second_recording_need_only_be_some(results: Path) -> None:
    table = pd.read_csv(results / "calibration.csv")
    limits = table[table["test"] == "contraction"].groupby("recordings")["limit"].unique()
    assert {name: list(values) for name, values in limits.items()} == {
        "own": [0.2],
        "acquired": [0.2],
        "local": [0.0],
    }


def test_a_classifier_that_finds_a_difference_or_nothing_is_flagged(results: Path) -> None:
    table = pd.read_csv(results / "calibration.csv")
    c2st = table[table["test"] == "c2st"].set_index(["subject", "sampler"])["flagged"]
    for subject in SUBJECTS:
        assert c2st.loc[subject].to_dict() == {"npe mcmc": 1, "weighted mcmc": 0, "npe weighted": 1}


def test_a_part_of_another_kind_is_refused(parts: tuple[list[Path], list[Path]], tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="local-A.h5"):
        calibration.calibration(
            recordings=parts[1],
            local_parts=parts[1],
            **{name: tmp_path / name for name in ("null", "calibration", "table", "alarms", "recovery")},
            recovery_acquisition=tmp_path / "last",
            settings=CalibrationStageSettings(prior=PRIOR.theta, judgement=JUDGEMENT, rule=speed_case.rule()),
            origin=Origin(1),
        )


FIGURE = CalibrationFigureSettings(
    judgement=JUDGEMENT, max_k_hat=0.7, experiment="calibrated", cohort_title="virtual volunteers"
)


@pytest.mark.parametrize(
    ("key", "value", "number"), [("replicates", 3000, 6000), ("two_sample_draws", 5001, 5001)]
)
def test_more_draws_than_a_posterior_keeps_are_refused(key: str, value: int, number: int) -> None:
    plain = copy.deepcopy(read_merged(ROOT / "config.yaml"))
    local = plain["experiments"]["calibrated"]["calibration"]["local"]
    local[key] = value
    local["mcmc"]["min_effective_draws"] = 6000
    with pytest.raises(
        ConfigError, match=rf"local\.{key} takes {number} posterior draws, .*exact\.draws = 5000"
    ):
        parse_config(plain)


def test_the_figure_is_written_from_the_results(results: Path, tmp_path: Path) -> None:
    check_figures.calibration_figure(
        calibration=results / "calibration.h5",
        table=results / "calibration.csv",
        figure_pdf=tmp_path / "figure.pdf",
        figure_png=tmp_path / "figure.png",
        settings=FIGURE,
        origin=Origin(1),
    )
    assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_a_table_without_its_columns_is_refused(results: Path, tmp_path: Path) -> None:
    pd.read_csv(results / "calibration.csv").drop(columns="limit").to_csv(tmp_path / "table.csv")
    with pytest.raises(ArtefactError, match="lacks the columns limit"):
        check_figures.calibration_figure(
            calibration=results / "calibration.h5",
            table=tmp_path / "table.csv",
            figure_pdf=tmp_path / "figure.pdf",
            figure_png=tmp_path / "figure.png",
            settings=FIGURE,
            origin=Origin(1),
        )


def test_recordings_like_a_subject_s_have_the_errors_of_its_group() -> None:
    """Those of ``acquisition`` are another laboratory's: errors told by the group would be wrong for them."""
    quality = RecordingSettings.from_plain(CONFIG["recording"])
    measured = SimpleNamespace(measurement=MeasurementSettings.from_plain(CONFIG["measurement"]))
    settings = SimpleNamespace(acquisition=ACQUISITION, recording=quality, model=measured)
    quiet = NoiseComponents(0.004, 0.06, 0.002)
    found = acquisition_of(observation("A"), quiet, settings)  # type: ignore[arg-type]
    made = found.protocol
    assert (made.repeat_sd_fraction, made.sample_sd_fraction, made.sweep_fraction) == (0.004, 0.06, 0.002)
    assert found.noise is quiet and found.missing_phases == (7,)
    assert made.failed_fraction == ACQUISITION.failed_fraction
