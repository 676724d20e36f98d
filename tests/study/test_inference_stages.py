"""The stages pool, train, posterior and recovery, on two small subjects of the real forward model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from inference_case import CONTEXTS
from inference_study import (
    MEASUREMENT,
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
from swesbi.checks.recovery import fresh_simulations, inferred
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement.likelihood import measured_subjects
from swesbi.networks.paper.estimator import draw_candidates
from swesbi.seeds import integer_seed
from swesbi.verdict.prior_support import judged_posterior


@pytest.fixture(scope="module")
def inputs() -> Inputs:
    return make_inputs()


@pytest.fixture(scope="module")
def results(inputs: Inputs) -> Results:
    return run_all(inputs)


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


def test_inputs_that_do_not_belong_together_are_refused(results: Results, inputs: Inputs) -> None:
    with pytest.raises(UnfitError, match="shards: hold 60 simulations of subject A, 61 are wanted"):
        make_pool(inputs, simulations_per_subject=61)
    with pytest.raises(UnfitError, match="passives: .*each subject needs one of each"):
        make_pool(inputs._replace(passives={"A": inputs.passives["A"]}))
    pool = make_pool(inputs, summary=SUMMARY.model_copy(update={"use_trajectory": False}))
    with pytest.raises(UnfitError, match="estimator: takes the components"):
        judged_posterior(pool, results.trained.estimator, subject="A", **POSTERIOR)
