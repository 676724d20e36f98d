"""Checkpoints: training is the same with them, they are the weights of their epochs, their files repeat."""

from pathlib import Path

import numpy as np
import pytest
import torch
from inference_case import WIDE_PRIOR, estimator_settings, pool_of_both, weights

from swesbi.artefacts import ArtefactError, Provenance, values_of
from swesbi.artefacts.files import provenance_of
from swesbi.networks.paper.estimator import Checkpoints, draw_candidates, losses
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.training import TrainedNetwork, train
from swesbi.networks.torch_prior import torch_prior
from swesbi.networks.training import reproducible

OVERSHOOTING = {
    procedure: estimator_settings(procedure=procedure, learning_rate=0.05, max_num_epochs=12)
    for procedure in ("sbi", "fast")
}
KEEP = (1, 4, 40)


@pytest.fixture(scope="module")
def pool() -> Pool:
    return pool_of_both()


def fit(pool: Pool, keep: tuple[int, ...], procedure: str) -> TrainedNetwork:
    arguments = (pool.theta, pool.z, pool.components.names, WIDE_PRIOR, OVERSHOOTING[procedure], 11)
    return train(*arguments, keep=keep)


@pytest.fixture(scope="module", params=["sbi", "fast"])
def procedure(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def trained(pool: Pool, procedure: str) -> TrainedNetwork:
    return fit(pool, KEEP, procedure)


def write(path: Path, training: TrainedNetwork) -> Path:
    training.checkpoints.write(path, Provenance("", seed=4))
    return path


def test_training_is_the_same_to_the_bit_with_and_without_checkpoints(
    pool: Pool, trained: TrainedNetwork, procedure: str
) -> None:
    without = fit(pool, (), procedure)
    assert without.training.equals(trained.training)
    np.testing.assert_equal(weights(without.estimator), weights(trained.estimator))


def test_epochs_asked_for_are_kept_with_the_best_and_the_last(trained: TrainedNetwork) -> None:
    kept = trained.checkpoints.of_epochs
    assert [one.epoch for one in kept] == sorted({1, 4, trained.estimator.epoch, 13})
    assert 4 < trained.estimator.epoch < 13, "needs a worse last epoch"
    course = trained.training.set_index("epoch")["validation_loss"]
    assert all(one.validation_loss == course[one.epoch] for one in kept)


def test_each_checkpoint_has_the_validation_loss_of_its_epoch(
    pool: Pool, trained: TrainedNetwork, tmp_path: Path
) -> None:
    with reproducible(11):
        torch_prior(WIDE_PRIOR).sample((1,))  # sbi draws once to learn the prior's device
        rows = torch.randperm(len(pool.theta))[int(0.9 * len(pool.theta)) :]
    theta, z = pool.theta[rows.numpy()], pool.z[rows.numpy()]
    for checkpoint in Checkpoints.read(write(tmp_path / "checkpoints.h5", trained)).of_epochs:
        assert losses(checkpoint, theta, z).mean() == pytest.approx(checkpoint.validation_loss, abs=1e-4)


def test_best_checkpoint_is_the_estimator(pool: Pool, trained: TrainedNetwork, tmp_path: Path) -> None:
    path = write(tmp_path / "checkpoints.h5", trained)
    best = Checkpoints.read(path).best
    assert (best.epoch, provenance_of(path).seed) == (trained.estimator.epoch, 4)
    arguments = (pool.z_obs, 200, 5)
    np.testing.assert_array_equal(
        draw_candidates(best, *arguments), draw_candidates(trained.estimator, *arguments)
    )


def test_checkpoint_file_repeats_to_the_byte(
    pool: Pool, trained: TrainedNetwork, procedure: str, tmp_path: Path
) -> None:
    again = fit(pool, KEEP, procedure)
    paths = [write(tmp_path / "one.h5", trained), write(tmp_path / "two.h5", again)]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    for back, kept in zip(Checkpoints.read(paths[0]).of_epochs, trained.checkpoints.of_epochs, strict=True):
        np.testing.assert_equal(values_of(back), values_of(kept))


def test_a_file_of_another_kind_is_refused(trained: TrainedNetwork, tmp_path: Path) -> None:
    path = tmp_path / "estimator.h5"
    trained.estimator.write(path, Provenance("estimator"))
    with pytest.raises(ArtefactError, match="holds a .estimator. artefact, expected .checkpoints"):
        Checkpoints.read(path)
