"""The study over acquisition seeds: the shipped seed gives the study's own outcome, others their own."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from inference_case import (
    CONTEXTS,
    OBSERVATION_MODEL,
    WIDE_PRIOR,
    components,
    estimator_settings,
    subject_features,
)
from study_copy import StudyCopy

from swesbi.artefacts import ArtefactError
from swesbi.checks.readings import recordings
from swesbi.config.read import overlay, read_yaml
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.networks.paper.maf import ROWS_PER_BATCH, draw_candidates, draw_until
from swesbi.networks.paper.pool import build_pool
from swesbi.networks.paper.training import train
from swesbi.prior import PriorSettings, in_bounds
from swesbi.show.training_tables import SCORES, SeedRow, medians_table, seeds_table
from swesbi.study.stages import acquisition_seeds
from swesbi.study.stages.origin import Origin
from swesbi.verdict.support import read_support

SUBJECTS = ("A", "F")


def settings_of(study: StudyCopy, **changes: object) -> acquisition_seeds.AcquisitionSeedsStageSettings:
    config = overlay(read_yaml(study.folder / "config.yaml"), read_yaml(study.folder / "smoke.yaml"))
    plain = stage_settings(load_study(config), "acquisition_seeds", experiment="paper")
    return acquisition_seeds.AcquisitionSeedsStageSettings.from_plain(plain | changes)


def judge(study: StudyCopy, folder: Path, settings: acquisition_seeds.AcquisitionSeedsStageSettings) -> None:
    results = study.results
    acquisition_seeds.acquisition_seeds(
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
def judged(finished: StudyCopy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("seeds")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(finished.folder)
        judge(finished, folder, settings_of(finished))
    return folder


def test_the_shipped_seed_gives_the_outcome_of_the_study(finished: StudyCopy, judged: Path) -> None:
    table = pd.read_csv(judged / "recordings.csv", keep_default_na=False, na_values="")
    shipped = table[table["shipped"] == 1].set_index("subject")
    study = pd.read_csv(finished.results / "tables" / "ppc.csv")
    study = study[study["experiment"] == "paper"].set_index("subject")
    assert tuple(shipped.index) == SUBJECTS
    assert study["supported"].any()
    for name, row in shipped.iterrows():
        support = read_support(finished.results / "paper" / "subjects" / str(name) / "support.json")
        assert row["max_abs_z"] == pytest.approx(support.max_abs_z, rel=1e-6)
        assert (row["worst_component"], row["supported"]) == (support.worst_component, support.supported)
        assert row["rmse_prior_kpa"] == pytest.approx(study["rmse_prior_kpa"][name], rel=1e-6)
        for score in SCORES:
            np.testing.assert_allclose(row[score], study[score][name], rtol=1e-6, err_msg=f"{name} {score}")


def test_other_seeds_are_other_recordings(judged: Path) -> None:
    table = pd.read_csv(judged / "recordings.csv")
    assert len(table) == 2 * len(SUBJECTS)
    assert (table.groupby("subject")["max_abs_z"].nunique() == 2).all()
    assert (table.groupby("subject")["rmse_prior_kpa"].nunique() == 2).all()


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


def test_a_subject_that_is_no_virtual_volunteer_is_refused(
    finished: StudyCopy, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(finished.folder)
    monkeypatch.setattr(recordings, "VOLUNTEERS", recordings.VOLUNTEERS[1:])
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
    unsupported = SeedRow(
        subject="A", acquisition_seed=3, max_abs_z=40.0, rmse_prior_kpa=9.0, **{**common, "within_z": False}
    )
    refused = SeedRow(subject="A", acquisition_seed=4, shipped=False, accepted=False, reason="no sample")
    (row,) = medians_table(seeds_table([*scored, unsupported, refused])).to_dict("records")
    assert (row["seeds"], row["seeds_within_z"], row["seeds_enough_draws"], row["seeds_supported"]) == (
        5,
        3,
        4,
        3,
    )
    assert (row["rmse_kpa"], row["max_abs_z"]) == (2.0, 1.5)


def test_drawing_until_enough_is_the_beginning_of_drawing_all() -> None:
    subjects = [subject_features(context, 60, np.zeros(4)) for context in CONTEXTS]
    pool = build_pool(subjects, components(), OBSERVATION_MODEL, seed=3)
    settings = estimator_settings(max_num_epochs=1)
    estimator = train(pool.theta, pool.z, pool.components.names, WIDE_PRIOR, settings, 1).estimator
    everything = draw_candidates(estimator, pool.z_obs[:1], 2 * ROWS_PER_BATCH + 500, 7)[0]

    def drawn(enough: int, prior: PriorSettings = WIDE_PRIOR) -> np.ndarray:
        return draw_until(estimator, pool.z_obs[0], enough, 2 * ROWS_PER_BATCH + 500, prior, 7)

    assert in_bounds(everything, WIDE_PRIOR).sum() < len(everything), "needs some leakage"
    for enough, batches in (
        (1, ROWS_PER_BATCH),
        (ROWS_PER_BATCH, 2 * ROWS_PER_BATCH),
        (10**6, len(everything)),
    ):
        np.testing.assert_array_equal(drawn(enough), everything[:batches])
