"""The stages pool, train, posterior and recovery, on two small subjects of the real forward model."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from inference_case import CONTEXTS
from inference_study import (
    DRAWS,
    MEASUREMENT,
    NOISE,
    POOL,
    POSTERIOR,
    RECOVERY,
    SUMMARY,
    TRAIN,
    Inputs,
    make_pool,
    run_all,
    write_inputs,
)

from swesbi.artefacts import ArtefactError, Origin, read_provenance
from swesbi.checks.recovery import fresh_simulations
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement.likelihood import read_measured_subjects
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import summary_names
from swesbi.networks.paper.estimator import load_estimator
from swesbi.networks.paper.maf import draw_candidates
from swesbi.networks.paper.pool import read_pool
from swesbi.posterior.truncated import read_posterior
from swesbi.seeds import integer_seed
from swesbi.study.stages import inference
from swesbi.verdict.verdict import read_verdict


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    return write_inputs(tmp_path_factory.mktemp("cohort"))


@pytest.fixture(scope="module")
def results(inputs: Inputs, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    run_all(folder, inputs, inputs.shards)
    return folder


def test_pool_holds_every_draw_augmentation_and_component(results: Path) -> None:
    data = read_pool(results / "pool.h5")
    assert data.z.shape == (2 * DRAWS * 3, 46 + 7)
    assert data.subjects == ("A", "B")
    assert data.components.features == summary_names(SUMMARY)
    raw = data.z * data.standardisation.scale + data.standardisation.mean
    noisy = np.flatnonzero([name in NOISE.feature_noise_sd for name in data.components.names])
    spread = raw.reshape(2 * DRAWS, 3, 53).std(axis=1).mean(axis=0)
    assert np.all(spread[noisy] > 0.01)
    assert np.all(np.delete(spread, noisy) < 1e-3)


def test_training_table_has_losses_and_nothing_of_the_clock(results: Path) -> None:
    frame = pd.read_csv(results / "training.csv")
    assert list(frame) == ["epoch", "training_loss", "validation_loss", "best_so_far"]
    assert list(frame["epoch"]) == list(range(1, 8))
    best, _ = load_estimator(results / "estimator.pt")
    assert frame["epoch"][frame["validation_loss"].idxmin()] == best.best_epoch
    assert frame["validation_loss"].min() == best.best_validation_loss


def test_posterior_and_support_agree(results: Path) -> None:
    for context in CONTEXTS:
        draws = read_posterior(results / f"{context.subject}.h5")
        verdict = read_verdict(results / f"{context.subject}.json")
        assert verdict.candidate_draws == 2000
        assert len(draws.theta) == min(300, verdict.in_prior_draws)
        assert verdict.max_abs_z == np.abs(draws.z_obs).max()
        assert draws.component_names[int(np.abs(draws.z_obs).argmax())] == verdict.worst_component


def test_recovery_has_a_row_for_each_parameter_and_level(results: Path) -> None:
    frame = pd.read_csv(results / "recovery.csv")
    assert len(frame) == 6
    assert frame["n"].between(5, 9).all()
    assert ((frame["ci_low"] <= frame["coverage"]) & (frame["coverage"] <= frame["ci_high"])).all()


def test_recovery_uses_theta_that_training_has_not_seen(results: Path) -> None:
    data = read_pool(results / "pool.h5")
    arguments = (RECOVERY.prior, RECOVERY.forward_model)
    fresh = [fresh_simulations(4, context, *arguments, 1).theta for context in CONTEXTS]
    seen = [draw_simulations(range(4), context, *arguments, 1).theta for context in CONTEXTS]
    for theta in seen:
        assert np.isin(theta.astype(np.float32), data.theta).all()
    assert not np.isin(np.concatenate(fresh).astype(np.float32), data.theta).any()


def test_recordings_are_inferred_with_the_statistics_of_the_pool(results: Path) -> None:
    data, (estimator, _) = read_pool(results / "pool.h5"), load_estimator(results / "estimator.pt")
    drawn = inference.infer(results / "pool.h5", results / "estimator.pt", data.observed, 50, 9)
    seed = integer_seed(9, "recovery", "posterior")
    np.testing.assert_array_equal(drawn, draw_candidates(estimator, data.z_obs, 50, seed))


def test_each_recording_meets_its_own_passive_baseline(inputs: Inputs) -> None:
    both = [
        read_measured_subjects(inputs.observations, inputs.passives[::step], MEASUREMENT) for step in (1, -1)
    ]
    scales = [[subject.passive.scale_kpa for subject in subjects] for subjects in both]
    assert scales[0] == scales[1] == [PassiveBaseline.read(path).scale_kpa for path in inputs.passives]
    assert scales[0][0] != scales[0][1]


def test_other_shards_and_another_run_give_the_same_bytes(
    results: Path, inputs: Inputs, tmp_path: Path
) -> None:
    run_all(tmp_path, inputs, inputs.whole_shards[::-1])
    written = sorted(path.name for path in results.iterdir())
    assert written == sorted(path.name for path in tmp_path.iterdir())
    assert len(written) == 9
    for name in written:
        assert (tmp_path / name).read_bytes() == (results / name).read_bytes(), name


def test_fewer_draws_are_the_first_of_the_same_draws(results: Path, inputs: Inputs, tmp_path: Path) -> None:
    make_pool(
        tmp_path / "pool.h5", inputs, inputs.shards, POOL.model_copy(update={"simulations_per_subject": 20})
    )
    small, full = read_pool(tmp_path / "pool.h5"), read_pool(results / "pool.h5")
    np.testing.assert_array_equal(small.theta, full.theta[full.draw_index < 20])


def test_missing_inputs_are_named(inputs: Inputs, tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="subject A: 60 simulations given, 61 wanted"):
        make_pool(
            tmp_path / "p.h5", inputs, inputs.shards, POOL.model_copy(update={"simulations_per_subject": 61})
        )
    with pytest.raises(ArtefactError, match="subject B: 0 simulations given"):
        make_pool(tmp_path / "p.h5", inputs, inputs.shards[:2], POOL)
    with pytest.raises(ArtefactError, match="each subject needs one of each"):
        make_pool(tmp_path / "p.h5", replace(inputs, passives=inputs.passives[:1]), inputs.shards, POOL)
    assert not (tmp_path / "p.h5").exists()


def test_estimator_of_other_features_is_refused(results: Path, inputs: Inputs, tmp_path: Path) -> None:
    scalars = SUMMARY.model_copy(update={"use_trajectory": False})
    make_pool(tmp_path / "pool.h5", inputs, inputs.shards, POOL.model_copy(update={"summary": scalars}))
    assert read_pool(tmp_path / "pool.h5").z.shape[1] == 16 + 7
    with pytest.raises(ArtefactError, match=r"estimator\.pt: takes the components"):
        inference.posterior(
            pool=tmp_path / "pool.h5",
            estimator=results / "estimator.pt",
            posterior=tmp_path / "A.h5",
            verdict=tmp_path / "A.json",
            settings=POSTERIOR,
            origin=Origin(9, "A"),
        )


def test_artefacts_say_where_they_come_from(results: Path) -> None:
    _, provenance = load_estimator(results / "estimator.pt")
    assert (provenance.kind, provenance.seed) == ("estimator", 9)
    assert provenance.settings == TRAIN.to_plain()
    assert read_provenance(provenance.attributes()) == provenance
    assert json.loads((results / "A.json").read_text())["candidate_draws"] == 2000


def test_readers_do_not_import_torch() -> None:
    names = ("networks.settings", "networks.paper.pool", "posterior.truncated", "verdict.prior_support")
    modules = [f"swesbi.{name}" for name in (*names, "population.synthetic")]
    code = f"import sys, {', '.join(modules)}; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
