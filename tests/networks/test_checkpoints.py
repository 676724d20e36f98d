"""Checkpoints: training is the same with them, they are the weights of their epochs, their file is plain."""

from pathlib import Path

import numpy as np
import pytest
import torch
from inference_case import (
    CONTEXTS,
    OBSERVATION_MODEL,
    WIDE_PRIOR,
    components,
    estimator_settings,
    subject_features,
)

from swesbi.artefacts import ArtefactError, Provenance
from swesbi.networks.determinism import reproducible
from swesbi.networks.files import plain_provenance
from swesbi.networks.paper.estimator import Checkpoints
from swesbi.networks.paper.maf import draw_candidates
from swesbi.networks.paper.pool import Pool, build_pool
from swesbi.networks.paper.training import Training, train
from swesbi.networks.torch_prior import torch_prior

OVERSHOOTING = {
    procedure: estimator_settings(procedure=procedure, learning_rate=0.05, max_num_epochs=12)
    for procedure in ("sbi", "fast")
}
KEEP = (1, 4, 40)


@pytest.fixture(scope="module")
def pool() -> Pool:
    observed = np.array([0.4, -0.3, 0.5, 0.1])
    subjects = [subject_features(context, 250, observed) for context in CONTEXTS]
    return build_pool(subjects, components(), OBSERVATION_MODEL, seed=3)


def fit(pool: Pool, keep: tuple[int, ...], procedure: str) -> Training:
    arguments = (pool.theta, pool.z, pool.components.names, WIDE_PRIOR, OVERSHOOTING[procedure], 11)
    return train(*arguments, keep=keep)


@pytest.fixture(scope="module", params=["sbi", "fast"])
def trained(pool: Pool, request: pytest.FixtureRequest) -> Training:
    return fit(pool, KEEP, request.param)


def write(path: Path, training: Training) -> Path:
    training.checkpoints.write(path, Provenance("", seed=4))
    return path


def test_training_is_the_same_to_the_bit_with_and_without_checkpoints(pool: Pool, trained: Training) -> None:
    without = fit(pool, (), trained.estimator.settings.procedure)
    assert without.epochs == trained.epochs
    one, two = without.estimator.net.state_dict(), trained.estimator.net.state_dict()
    assert all(torch.equal(one[name], two[name]) for name in two)


def test_epochs_asked_for_are_kept_with_the_best_and_the_last(trained: Training) -> None:
    kept = trained.checkpoints.of_epochs
    assert [one.epoch for one in kept] == sorted({1, 4, trained.estimator.best_epoch, 13})
    assert 4 < trained.estimator.best_epoch < 13, "needs a worse last epoch"
    losses = {epoch.number: epoch.validation_loss for epoch in trained.epochs}
    assert all(one.validation_loss == losses[one.epoch] for one in kept)


def test_each_checkpoint_has_the_validation_loss_of_its_epoch(
    pool: Pool, trained: Training, tmp_path: Path
) -> None:
    with reproducible(11):
        torch_prior(WIDE_PRIOR).sample((1,))  # sbi draws once to learn the prior's device
        rows = torch.randperm(len(pool.theta))[int(0.9 * len(pool.theta)) :]
    theta, z = torch.from_numpy(pool.theta)[rows], torch.from_numpy(pool.z)[rows]
    for checkpoint in Checkpoints.read(write(tmp_path / "checkpoints.pt", trained)).of_epochs:
        with torch.no_grad():
            loss = -float(checkpoint.net.log_prob(theta, z).mean())
        assert loss == pytest.approx(checkpoint.validation_loss, abs=1e-4)


def test_best_checkpoint_is_the_estimator(pool: Pool, trained: Training, tmp_path: Path) -> None:
    path = write(tmp_path / "checkpoints.pt", trained)
    best = Checkpoints.read(path).best
    assert (best.epoch, plain_provenance(path).seed) == (trained.estimator.best_epoch, 4)
    arguments = (pool.z_obs, 200, 5)
    np.testing.assert_array_equal(
        draw_candidates(best, *arguments), draw_candidates(trained.estimator, *arguments)
    )


def test_checkpoint_file_is_plain_and_reproducible(pool: Pool, trained: Training, tmp_path: Path) -> None:
    again = fit(pool, KEEP, trained.estimator.settings.procedure)
    paths = [write(tmp_path / "one.pt", trained), write(tmp_path / "two.pt", again)]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert torch.load(paths[0], weights_only=True)["metadata"]["epochs"][0] == 1


def test_a_file_of_another_kind_is_refused(trained: Training, tmp_path: Path) -> None:
    path = tmp_path / "estimator.pt"
    trained.estimator.write(path, Provenance("estimator"))
    with pytest.raises(ArtefactError, match="holds a .estimator. artefact, expected .checkpoints"):
        Checkpoints.read(path)
