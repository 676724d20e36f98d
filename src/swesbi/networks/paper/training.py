"""Training the estimator by sbi's procedure (paper, Eq. 8), reported epoch by epoch."""

from __future__ import annotations

import contextlib
import io
import logging
import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from sbi.inference import NPE_C
from torch import Tensor

from swesbi.networks.determinism import reproducible
from swesbi.networks.paper.estimator import Checkpoint, Checkpoints, TrainedEstimator
from swesbi.networks.paper.maf import MaskedFlow
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.sbi_trainer import EpochRecord, SbiTrainer, on_cpu
from swesbi.networks.settings import EstimatorSettings, Procedure
from swesbi.networks.training_tables import Epoch, TrainingTable, losses_table
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings
from swesbi.seeds import integer_seed

LOGGER = logging.getLogger("swesbi")


@dataclass(frozen=True)
class Training:
    """The outcome of one training.

    Attributes:
        estimator: The estimator of the best epoch.
        epochs: Every epoch in order.
        checkpoints: The estimator after the epochs asked for, the best and the last.
    """

    estimator: TrainedEstimator
    epochs: tuple[Epoch, ...]
    checkpoints: Checkpoints


class TrainedNetwork(NamedTuple):
    """A trained network, the losses of every epoch, and the network after some of them."""

    estimator: TrainedEstimator
    training: TrainingTable
    checkpoints: Checkpoints


def trained_network(
    pool: Pool,
    *,
    prior: PriorSettings,
    estimator: EstimatorSettings,
    checkpoint_epochs: tuple[int, ...],
    experiment: str,
    seed: int,
    device: str = "auto",
) -> TrainedNetwork:
    """Train q(theta | z) on the pool.

    On the CPU the result repeats exactly. CUDA sums in another order: its weights differ in rounding, and no
    more than another seed's would.

    Args:
        pool: The training set.
        prior: The prior that its theta were drawn from.
        estimator: Architecture and training settings.
        checkpoint_epochs: Epochs whose weights are kept beside the best and the last.
        experiment: Its name, in progress lines.
        seed: Of the study.
        device: "auto", "cpu" or "cuda".

    Raises:
        ValueError: As of ``train``.
    """
    label, device = f"training {experiment}", choose_device(device, estimator.procedure)
    LOGGER.info(
        "%s: %d rows of %d components on %s, procedure %s", label, *pool.z.shape, device, estimator.procedure
    )
    result = train(
        pool.theta,
        pool.z,
        pool.components.names,
        prior,
        estimator,
        integer_seed(seed, "training"),
        device,
        label,
        checkpoint_epochs,
    )
    return TrainedNetwork(result.estimator, losses_table(result.epochs), result.checkpoints)


def train(
    theta: NDArray[np.float32],
    z: NDArray[np.float32],
    components: tuple[str, ...],
    prior: PriorSettings,
    settings: EstimatorSettings,
    seed: int,
    device: str = "cpu",
    label: str = "training",
    keep: Collection[int] = (),
) -> Training:
    """Fit q(theta | z) to the pool's rows by NPE-C's first round, that is by maximum likelihood.

    Training runs on one thread under ``seed``, so on the CPU it repeats exactly. The weights of the
    best epoch are restored; sbi itself does so only when it stops before its last epoch.

    Args:
        theta: (N, 3) parameters.
        z: (N, C) conditioning vectors.
        components: Names of the C components.
        prior: The prior that theta was drawn from.
        settings: Architecture and training settings.
        seed: Seed of the initial weights, of the split into training and held-out rows, and of the batches.
        device: "auto", "cpu" or "cuda".
        label: Name of the training in progress lines.
        keep: Epochs whose weights are kept, from 1; those that training does not reach are left out.

    Raises:
        ValueError: The device is not available, there are too few rows for a split, or the loss became
            infinite or NaN (raised by sbi).
    """
    device = choose_device(device, settings.procedure)
    _check_rows(len(theta), settings)
    with reproducible(seed), contextlib.redirect_stdout(io.StringIO()) as printed:
        record = EpochRecord(label, settings.max_num_epochs + 1)
        trainer = trainer_of(settings.procedure)(record, prior, settings, device, keep)
        _append(trainer, torch.from_numpy(theta), torch.from_numpy(z))
        trainer.train(
            training_batch_size=settings.batch_size,
            learning_rate=settings.learning_rate,
            validation_fraction=settings.validation_fraction,
            stop_after_epochs=settings.stop_after_epochs,
            max_num_epochs=settings.max_num_epochs,
            clip_max_norm=settings.clip_max_norm,
        )
    LOGGER.debug("sbi: %s", printed.getvalue().strip())
    best, state = record.best, on_cpu(trainer.best_state)
    net = MaskedFlow(settings, theta.shape[1], z.shape[1], state)
    LOGGER.info("%s: best epoch %d of %d run, validation loss %.4f", label, *best, record.best_loss)
    estimator = TrainedEstimator(net, settings, components, *best, record.best_loss)
    states = trainer.kept | {best[0]: state}
    return Training(estimator, tuple(record.epochs), _checkpoints(states, estimator, record.epochs))


def _checkpoints(
    states: Mapping[int, Mapping[str, Tensor]], estimator: TrainedEstimator, epochs: Sequence[Epoch]
) -> Checkpoints:
    """Return the estimator with the weights after some epochs, by number."""
    settings, inputs = estimator.settings, estimator.components
    kept = [
        Checkpoint(
            epoch=number,
            validation_loss=epochs[number - 1].validation_loss,
            best=number == estimator.best_epoch,
            components=inputs,
            net=MaskedFlow(settings, len(THETA_NAMES), len(inputs), states[number]),
        )
        for number in sorted(states)
    ]
    return Checkpoints(settings, tuple(kept))


def trainer_of(procedure: Procedure) -> type[SbiTrainer]:
    """Return the class that trains by a procedure of the settings."""
    if procedure == "sbi":
        return SbiTrainer
    # Only here: sbi's own procedure must give the study without the derivatives written by hand.
    from swesbi.networks.accelerated.trainer import FastTrainer

    return FastTrainer


def _append(trainer: NPE_C, theta: Tensor, z: Tensor) -> None:
    """Hand the rows to sbi, without its advice against standardising far values or constant components.

    The rows were standardised in double precision, where neither loses a digit.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Data has extreme outliers")
        warnings.filterwarnings("ignore", message="Data has .*constant")
        trainer.append_simulations(theta, z, exclude_invalid_x=False)


def choose_device(device: str, procedure: str = "sbi") -> str:
    """Turn "auto" into "cuda" where a CUDA device is available, else "cpu".

    The fast procedure stays on the CPU under "auto": a step of it is a hundred operations of a few
    microseconds, and a GPU takes as long to start each.

    Raises:
        ValueError: The device is unknown or not available.
    """
    if device not in ("auto", "cpu", "cuda"):
        raise ValueError(f"device {device!r} is not one of auto, cpu, cuda")
    available = torch.cuda.is_available()
    if device == "cuda" and not available:
        raise ValueError("device 'cuda' was asked for, but torch finds no CUDA device; use auto or cpu")
    if device == "auto" and procedure == "fast":
        return "cpu"
    return "cuda" if available and device != "cpu" else "cpu"


def _check_rows(rows: int, settings: EstimatorSettings) -> None:
    held_out = rows - int((1 - settings.validation_fraction) * rows)
    if held_out < 2 or rows - held_out < 2:
        raise ValueError(
            f"{rows} rows cannot be split with validation_fraction = {settings.validation_fraction}; "
            "simulate more draws or change the fraction"
        )
