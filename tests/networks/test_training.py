import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from inference_case import (
    OBSERVED,
    WIDE_PRIOR,
    estimator_settings,
    known_posterior,
    pool_of_both,
    weights,
)
from numpy.typing import NDArray
from sbi.inference import NPE_C
from sbi.neural_nets import posterior_nn

from swesbi.artefacts import ArtefactError, Provenance, values_of
from swesbi.artefacts.files import provenance_of
from swesbi.networks.paper.estimator import ROWS_PER_BATCH, TrainedEstimator, draw_candidates, losses
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.training import choose_device, train
from swesbi.networks.paper.weights import arrays_of
from swesbi.networks.settings import EstimatorSettings
from swesbi.networks.torch_prior import torch_prior
from swesbi.networks.training import TrainingTable, reproducible

FAST = estimator_settings()
PROCEDURES = ("sbi", "fast")
ELSEWHERE = """
import sys
import numpy as np
from pathlib import Path
import swesbi.verdict.prior_support
from swesbi.networks.paper.estimator import draw_candidates
from swesbi.networks.paper.estimator import TrainedEstimator
folder = Path(sys.argv[1])
estimator = TrainedEstimator.read(folder / "estimator.h5")
np.save(folder / "draws.npy", draw_candidates(estimator, np.load(folder / "z.npy"), 300, 5))
print("sbi" in sys.modules)
from swesbi.networks.paper.training import train
from swesbi.networks.settings import EstimatorSettings
from swesbi.prior import PriorSettings, sample
prior = PriorSettings.model_validate_json(sys.argv[2])
rng = np.random.default_rng(1)
theta, z = sample(200, prior, rng).astype(np.float32), rng.standard_normal((200, 2)).astype(np.float32)
for settings in map(EstimatorSettings.model_validate_json, sys.argv[3:]):
    train(theta, z, ("first", "second"), prior, settings, seed=1)
    print(any(name.startswith("swesbi.networks.paper.accelerated") for name in sys.modules))
"""
"""Draws, then trains by one procedure after the other; says what of sbi and by hand is loaded by then."""


@pytest.fixture(scope="module")
def pool() -> Pool:
    return pool_of_both()


def fit(pool: Pool, settings: EstimatorSettings, seed: int = 11) -> tuple[TrainedEstimator, TrainingTable]:
    result = train(pool.theta, pool.z, pool.components.names, WIDE_PRIOR, settings, seed)
    return result.estimator, result.training


@pytest.fixture(scope="module")
def trained(pool: Pool) -> TrainedEstimator:
    return fit(pool, FAST)[0]


@pytest.fixture(scope="module")
def elsewhere(
    pool: Pool, trained: TrainedEstimator, tmp_path_factory: pytest.TempPathFactory
) -> tuple[NDArray[np.float64], list[str]]:
    """What another process draws from the estimator's file, and what it says of the modules it loads."""
    folder = tmp_path_factory.mktemp("elsewhere")
    trained.write(folder / "estimator.h5", Provenance("estimator", seed=4))
    np.save(folder / "z.npy", pool.z_obs)
    procedures = [estimator_settings(procedure=name, max_num_epochs=1) for name in PROCEDURES]
    texts = [each.model_dump_json() for each in (WIDE_PRIOR, *procedures)]
    command = [sys.executable, "-c", ELSEWHERE, str(folder), *texts]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return np.load(folder / "draws.npy"), done.stdout.split()


def held_out_loss(pool: Pool, estimator: TrainedEstimator, rows: torch.Tensor) -> float:
    return float(losses(estimator, pool.theta[rows.numpy()], pool.z[rows.numpy()]).mean())


def test_training_is_that_of_stock_sbi_to_the_bit(pool: Pool) -> None:
    ours, epochs = fit(pool, FAST)
    with reproducible(11):
        trainer = NPE_C(
            prior=torch_prior(WIDE_PRIOR),
            density_estimator=posterior_nn("maf", hidden_features=16, num_transforms=2),
            tracker=_Silent(),
            show_progress_bars=False,
        ).append_simulations(torch.from_numpy(pool.theta), torch.from_numpy(pool.z))
        net = trainer.train(training_batch_size=50, max_num_epochs=2)
    for name in ("validation_loss", "training_loss"):
        assert list(epochs[name]) == trainer.summary[name]
    net.load_state_dict(trainer._best_model_state_dict)
    np.testing.assert_equal(weights(ours), values_of(arrays_of(net))["/"])


@pytest.mark.parametrize("procedure", PROCEDURES)
def test_weights_of_the_best_epoch_are_kept_though_training_went_on(pool: Pool, procedure: str) -> None:
    settings = estimator_settings(procedure=procedure, learning_rate=0.05, max_num_epochs=12)
    estimator, epochs = fit(pool, settings)
    course = list(epochs["validation_loss"])
    assert len(epochs) == 13
    assert estimator.epoch == int(np.argmin(course)) + 1 < 13, "needs a worse last epoch"
    assert list(epochs["best_so_far"]) == [
        int(course[i] < min(course[:i], default=np.inf)) for i in range(13)
    ]
    with reproducible(11):
        torch_prior(WIDE_PRIOR).sample((1,))  # sbi draws once to learn the prior's device
        held_out = torch.randperm(len(pool.theta))[int(0.9 * len(pool.theta)) :]
    assert held_out_loss(pool, estimator, held_out) == pytest.approx(min(course), abs=1e-4)


@pytest.mark.parametrize("procedure", PROCEDURES)
def test_training_stops_early_and_says_so(pool: Pool, procedure: str) -> None:
    settings = estimator_settings(
        procedure=procedure, learning_rate=0.05, max_num_epochs=200, stop_after_epochs=3
    )
    estimator, epochs = fit(pool, settings)
    assert len(epochs) == estimator.epoch + 3 < 201


def test_drawing_does_without_sbi_and_its_procedure_without_the_derivatives_written_by_hand(
    elsewhere: tuple[NDArray[np.float64], list[str]],
) -> None:
    drawn, sbi, fast = elsewhere[1]
    assert (drawn, sbi, fast) == ("False", "False", "True")


@pytest.mark.parametrize("procedure", PROCEDURES)
def test_nothing_is_left_behind(
    procedure: str,
    pool: Pool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    torch.manual_seed(0)
    before, threads = torch.random.get_rng_state(), torch.get_num_threads()
    torch.set_num_threads(2)
    fit(pool, estimator_settings(procedure=procedure))
    assert torch.get_num_threads() == 2
    torch.set_num_threads(threads)
    assert list(tmp_path.iterdir()) == []
    assert capsys.readouterr().out == ""
    assert torch.equal(before, torch.random.get_rng_state())


@pytest.mark.parametrize("procedure", PROCEDURES)
def test_every_epoch_is_reported(pool: Pool, caplog: pytest.LogCaptureFixture, procedure: str) -> None:
    with caplog.at_level(logging.INFO, logger="swesbi"):
        _, epochs = fit(pool, estimator_settings(procedure=procedure))
    for epoch in epochs.itertuples():
        lines = [line for line in caplog.messages if f"epoch {epoch.epoch}/3 " in line]
        assert len(lines) == 1
        assert f"validation {epoch.validation_loss:.4f}" in lines[0]


def test_estimator_is_rebuilt_in_another_process_with_equal_draws(
    pool: Pool, trained: TrainedEstimator, elsewhere: tuple[NDArray[np.float64], list[str]]
) -> None:
    np.testing.assert_array_equal(elsewhere[0], draw_candidates(trained, pool.z_obs, 300, 5))


def test_estimator_file_repeats_to_the_byte(trained: TrainedEstimator, tmp_path: Path) -> None:
    paths = [tmp_path / "one.h5", tmp_path / "other_name.h5"]
    for path in paths:
        trained.write(path, Provenance("estimator", seed=4, settings={"a": 1}))
    assert paths[0].read_bytes() == paths[1].read_bytes()
    back, provenance = TrainedEstimator.read(paths[0]), provenance_of(paths[0])
    assert (provenance.kind, provenance.seed, provenance.settings) == ("estimator", 4, {"a": 1})
    assert (back.epoch, back.best, back.components) == (trained.epoch, True, trained.components)
    np.testing.assert_equal(weights(back), weights(trained))
    assert [each.dtype for each in weights(back).values()] == [
        each.dtype for each in weights(trained).values()
    ]


@pytest.mark.parametrize("content", [b"", b"not HDF5", None])
def test_broken_estimator_file_is_refused_with_its_name(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "estimator.h5"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ArtefactError, match=r"estimator\.h5: (has no checksum|no such file)"):
        TrainedEstimator.read(path)


def test_draws_are_counted_exactly_and_z_must_fit(pool: Pool, trained: TrainedEstimator) -> None:
    draws = draw_candidates(trained, pool.z_obs, ROWS_PER_BATCH + 7, 1)
    assert draws.shape == (2, ROWS_PER_BATCH + 7, 3)
    with pytest.raises(ValueError, match="11 components"):
        draw_candidates(trained, pool.z_obs[:, :5], 10, 1)


def test_device_is_chosen_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert (choose_device("auto"), choose_device("cpu")) == ("cpu", "cpu")
    with pytest.raises(ValueError, match="no CUDA device"):
        choose_device("cuda")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert (choose_device("auto"), choose_device("cpu"), choose_device("cuda")) == ("cuda", "cpu", "cuda")
    assert (choose_device("auto", "fast"), choose_device("cuda", "fast")) == ("cpu", "cuda")


def test_learned_posterior_is_the_known_one() -> None:
    """The whole path from prior draws to posterior draws against Gaussian conditioning.

    By the fast procedure, whose course is that of sbi (``test_accelerated.py``).
    """
    pool = pool_of_both(3000)
    settings = estimator_settings(procedure="fast", max_num_epochs=14, learning_rate=2e-3, batch_size=100)
    estimator, _ = fit(pool, settings)
    draws = np.log(draw_candidates(estimator, pool.z_obs[:1], 20_000, 1)[0].clip(1e-3))
    known = known_posterior(OBSERVED)
    sd = np.sqrt(np.diag(known.covariance))
    np.testing.assert_allclose((draws.mean(axis=0) - known.mean) / sd, 0.0, atol=0.25)
    np.testing.assert_allclose(draws.std(axis=0) / sd, 1.0, atol=0.2)
    correlation = known.covariance / np.outer(sd, sd)
    np.testing.assert_allclose(np.corrcoef(draws, rowvar=False), correlation, atol=0.2)


class _Silent:
    log_dir = None

    def log_metric(self, name: str, value: float, step: int | None = None) -> None: ...

    def flush(self) -> None: ...
