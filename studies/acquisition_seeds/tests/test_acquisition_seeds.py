"""The study over acquisition seeds: the shipped seed gives the study's own outcome, others their own."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from study_copy import StudyCopy

from studies.acquisition_seeds import stages, truth
from studies.acquisition_seeds.judge import AcquisitionSeedsStageSettings
from studies.acquisition_seeds.settings import judged_settings
from studies.acquisition_seeds.table import SCORES, SeedRow, medians_table, seeds_table
from swesbi.artefacts import ArtefactError, Origin
from swesbi.config.read import overlay, read_merged, read_yaml
from swesbi.config.study import load_study
from swesbi.verdict.verdict import read_verdict

SUBJECTS = ("A", "F")


def settings_of(study: StudyCopy, **changes: object) -> AcquisitionSeedsStageSettings:
    config = overlay(read_merged(study.folder / "config.yaml"), read_yaml(study.folder / "smoke.yaml"))
    plain = judged_settings(load_study(config), "paper", (1, 2))
    return AcquisitionSeedsStageSettings.from_plain(plain | changes)


def judge(study: StudyCopy, folder: Path, settings: AcquisitionSeedsStageSettings) -> None:
    results = study.results
    stages.acquisition_seeds(
        pool=results / "paper" / "pool.h5",
        estimator=results / "paper" / "estimator.pt",
        observations=[results / "cohort" / name / "observation.h5" for name in SUBJECTS],
        passives=[results / "cohort" / name / "passive.h5" for name in SUBJECTS],
        shards=sorted(results.glob("simulations/paper/*/shard-*.h5")),
        recordings=folder / "recordings.csv",
        medians=folder / "medians.csv",
        settings=settings,
        origin=Origin(20260),
    )


@pytest.fixture(scope="module")
def tables(finished: StudyCopy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("seeds")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(finished.folder)
        judge(finished, folder, settings_of(finished))
    return folder


@pytest.mark.slow(minutes=0.5)
def test_the_shipped_seed_gives_the_outcome_of_the_study(finished: StudyCopy, tables: Path) -> None:
    table = pd.read_csv(tables / "recordings.csv", keep_default_na=False, na_values="")
    shipped = table[table["shipped"] == 1].set_index("subject")
    study = pd.read_csv(finished.results / "tables" / "ppc.csv")
    study = study[study["experiment"] == "paper"].set_index("subject")
    assert tuple(shipped.index) == SUBJECTS
    assert study["may_be_read"].any()
    for name, row in shipped.iterrows():
        verdict = read_verdict(finished.results / "paper" / "subjects" / str(name) / "verdict.json")
        assert row["max_abs_z"] == pytest.approx(verdict.max_abs_z, rel=1e-6)
        assert (row["worst_component"], row["supported"]) == (verdict.worst_component, verdict.may_be_read)
        assert row["rmse_prior_kpa"] == pytest.approx(study["rmse_prior_kpa"][name], rel=1e-6)
        for score in SCORES:
            np.testing.assert_allclose(row[score], study[score][name], rtol=1e-6, err_msg=f"{name} {score}")


@pytest.mark.slow(minutes=0.1)
def test_other_seeds_are_other_recordings(tables: Path) -> None:
    table = pd.read_csv(tables / "recordings.csv")
    assert len(table) == 2 * len(SUBJECTS)
    assert (table.groupby("subject")["max_abs_z"].nunique() == 2).all()
    assert (table.groupby("subject")["rmse_prior_kpa"].nunique() == 2).all()


@pytest.mark.slow(minutes=0.5)
def test_a_supported_recording_has_scores_and_no_other(
    finished: StudyCopy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished.folder)
    lenient = {"max_abs_z": 1e6, "min_in_prior_draws": 100, "candidate_draws": 4000}
    judge(finished, tmp_path, settings_of(finished, support=lenient, seeds=[3]))
    table = pd.read_csv(tmp_path / "recordings.csv").set_index("subject")
    assert table["within_z"].all()
    assert table["supported"].any()
    for score in SCORES:
        assert (table[score].notna() == (table["supported"] == 1)).all(), score
    judge(finished, tmp_path, settings_of(finished, support=lenient | {"max_abs_z": 1e-3}, seeds=[3]))
    strict = pd.read_csv(tmp_path / "recordings.csv").set_index("subject")
    assert not strict["supported"].any()
    assert (strict["enough_draws"] == table["enough_draws"]).all()
    assert strict["rmse_kpa"].isna().all()
    assert strict["reason"].str.contains("outside what the prior predicts").all()


@pytest.mark.slow(minutes=0.1)
def test_a_subject_that_is_no_virtual_volunteer_is_refused(
    finished: StudyCopy, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(finished.folder)
    monkeypatch.setattr(truth, "VOLUNTEERS", truth.VOLUNTEERS[1:])
    with pytest.raises(ArtefactError, match="subject A: its context is that of no virtual volunteer"):
        judge(finished, tmp_path, settings_of(finished))


def test_medians_count_and_skip_what_is_missing() -> None:
    common = {"shipped": False, "accepted": True, "within_z": True, "enough_draws": True}
    scored = [
        SeedRow(
            subject="A",
            acquisition_seed=i,
            supported=True,
            max_abs_z=i,
            rmse_prior_kpa=9.0,
            rmse_kpa=rmse,
            **common,
        )
        for i, rmse in enumerate((1.0, 2.0, 6.0))
    ]
    excluded = SeedRow(
        subject="A", acquisition_seed=3, max_abs_z=40.0, rmse_prior_kpa=9.0, **{**common, "within_z": False}
    )
    refused = SeedRow(subject="A", acquisition_seed=4, shipped=False, accepted=False, reason="no sample")
    (row,) = medians_table(seeds_table([*scored, excluded, refused])).to_dict("records")
    assert (row["seeds"], row["seeds_within_z"], row["seeds_enough_draws"], row["seeds_supported"]) == (
        5,
        3,
        4,
        3,
    )
    assert (row["rmse_kpa"], row["max_abs_z"]) == (2.0, 1.5)
