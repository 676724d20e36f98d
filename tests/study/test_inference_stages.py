"""The stages pool, train, posterior and recovery, on two small subjects of the real forward model."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from inference_case import CONTEXTS
from inference_study import (
    DRAWS,
    MEASUREMENT,
    NOISE,
    POSTERIOR,
    RECOVERY,
    SUMMARY,
    Inputs,
    Results,
    make_inputs,
    make_pool,
    run_all,
)

from swesbi.artefacts import UnfitError
from swesbi.checks.recovery import fresh_simulations
from swesbi.checks.synthetic_recovery import inferred
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement.likelihood import measured_subjects
from swesbi.measurement.settings import summary_names
from swesbi.networks.paper.draws import draw_candidates
from swesbi.seeds import integer_seed
from swesbi.verdict.network_posterior import judged_posterior


@pytest.fixture(scope="module")
def inputs() -> Inputs:
    return make_inputs()


@pytest.fixture(scope="module")
def results(inputs: Inputs) -> Results:
    return run_all(inputs)


def test_pool_holds_every_draw_augmentation_and_component(results: Results) -> None:
    data = results.pool
    assert data.z.shape == (2 * DRAWS * 3, 46 + 7)
    assert data.subjects == ("A", "B")
    assert data.components.features == summary_names(SUMMARY)
    raw = data.z * data.standardisation.scale + data.standardisation.mean
    noisy = np.flatnonzero([name in NOISE.feature_noise_sd for name in data.components.names])
    spread = raw.reshape(2 * DRAWS, 3, 53).std(axis=1).mean(axis=0)
    assert np.all(spread[noisy] > 0.01)
    assert np.all(np.delete(spread, noisy) < 1e-3)


def test_training_table_has_losses_and_nothing_of_the_clock(results: Results) -> None:
    frame, best = results.trained.training, results.trained.estimator
    assert list(frame) == ["epoch", "training_loss", "validation_loss", "best_so_far"]
    assert list(frame["epoch"]) == list(range(1, 8))
    assert frame["epoch"][frame["validation_loss"].idxmin()] == best.epoch
    assert frame["validation_loss"].min() == best.validation_loss


def test_posterior_and_support_agree(results: Results) -> None:
    for draws, verdict in results.judged.values():
        assert verdict.candidate_draws == 2000
        assert len(draws.theta) == min(300, verdict.in_prior_draws)
        assert verdict.max_abs_z == np.abs(draws.z_obs).max()
        assert draws.component_names[int(np.abs(draws.z_obs).argmax())] == verdict.worst_component


def test_recovery_has_a_row_for_each_parameter_and_level(results: Results) -> None:
    frame = results.recovery
    assert len(frame) == 6
    assert frame["n"].between(5, 9).all()
    assert ((frame["ci_low"] <= frame["coverage"]) & (frame["coverage"] <= frame["ci_high"])).all()


def test_recovery_uses_theta_that_training_has_not_seen(results: Results) -> None:
    data, arguments = results.pool, (RECOVERY["prior"], RECOVERY["forward_model"])
    fresh = [fresh_simulations(4, context, *arguments, 1).theta for context in CONTEXTS]
    seen = [draw_simulations(range(4), context, *arguments, 1).theta for context in CONTEXTS]
    for theta in seen:
        assert np.isin(theta.astype(np.float32), data.theta).all()
    assert not np.isin(np.concatenate(fresh).astype(np.float32), data.theta).any()


def test_recordings_are_inferred_with_the_statistics_of_the_pool(results: Results) -> None:
    data, estimator = results.pool, results.trained.estimator
    drawn = inferred(data, estimator, data.observed, RECOVERY["recovery"], 9)
    seed = integer_seed(9, "recovery", "posterior")
    np.testing.assert_array_equal(drawn, draw_candidates(estimator, data.z_obs, 200, seed))


def test_each_recording_meets_its_own_passive_baseline(inputs: Inputs) -> None:
    other = dict(reversed(inputs.passives.items()))
    both = [measured_subjects(inputs.observations, own, MEASUREMENT) for own in (inputs.passives, other)]
    scales = [[subject.passive.scale_kpa for subject in subjects] for subjects in both]
    assert scales[0] == scales[1] == [passive.scale_kpa for passive in inputs.passives.values()]
    assert scales[0][0] != scales[0][1]


def test_other_shards_and_another_run_give_the_same_bytes(
    results: Results, inputs: Inputs, tmp_path: Path
) -> None:
    results.write(tmp_path / "one")
    run_all(inputs._replace(shards=inputs.whole_shards)).write(tmp_path / "two")
    written = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert written == sorted(path.name for path in (tmp_path / "two").iterdir())
    assert len(written) == 9
    for name in written:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_fewer_draws_are_the_first_of_the_same_draws(results: Results, inputs: Inputs) -> None:
    small, full = make_pool(inputs, simulations_per_subject=20), results.pool
    np.testing.assert_array_equal(small.theta, full.theta[full.draw_index < 20])


def test_missing_inputs_are_named(inputs: Inputs) -> None:
    with pytest.raises(UnfitError, match="shards: hold 60 simulations of subject A, 61 are wanted"):
        make_pool(inputs, simulations_per_subject=61)
    with pytest.raises(UnfitError, match="passives: .*each subject needs one of each"):
        make_pool(inputs._replace(passives={"A": inputs.passives["A"]}))


def test_estimator_of_other_features_is_refused(results: Results, inputs: Inputs) -> None:
    pool = make_pool(inputs, summary=SUMMARY.model_copy(update={"use_trajectory": False}))
    assert pool.z.shape[1] == 16 + 7
    with pytest.raises(UnfitError, match="estimator: takes the components"):
        judged_posterior(pool, results.trained.estimator, subject="A", **POSTERIOR)


def test_readers_do_not_import_torch() -> None:
    names = ("networks.settings", "networks.paper.pool", "posterior.truncated", "verdict.prior_support")
    modules = [f"swesbi.{name}" for name in (*names, "population.synthetic")]
    code = f"import sys, {', '.join(modules)}; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
