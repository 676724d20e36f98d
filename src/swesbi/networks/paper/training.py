"""Training the estimator by sbi's procedure (paper, Eq. 8), reported epoch by epoch."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from sbi.inference import NPE_C
from torch import Tensor

from swesbi.base.progress import LOGGER
from swesbi.networks.paper.estimator import Checkpoints, TrainedEstimator
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.sbi_trainer import SbiTrainer
from swesbi.networks.settings import EstimatorSettings, Procedure
from swesbi.networks.training import EpochRecord, TrainingTable, losses_table, reproducible
from swesbi.prior import PriorSettings
from swesbi.seeds import integer_seed


class TrainedNetwork(NamedTuple):
    """The network of the best epoch, the losses of every epoch, and the network after some of them."""

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
    """Train q(theta | z) on the pool, and keep the weights of some epochs beside the best and the last.

    On the CPU the result repeats exactly. CUDA sums in another order: its weights differ in rounding, and no
    more than another seed's would.

    Raises:
        ValueError: The device is not available, the rows are too few for a split, or the loss became
            infinite or NaN (raised by sbi).
    """
    return train(
        pool.theta,
        pool.z,
        pool.components.names,
        prior,
        estimator,
        integer_seed(seed, "training"),
        device,
        f"training {experiment}",
        checkpoint_epochs,
    )


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
) -> TrainedNetwork:
    """Fit q(theta | z) to rows theta (N, 3), z (N, C) by NPE-C's first round: by maximum likelihood.

    Training runs on one thread under ``seed``, so on the CPU it repeats exactly. Epochs to ``keep`` count
    from 1; those that training does not reach are left out.
    """
    device = choose_device(device, settings.procedure)
    LOGGER.info(
        "%s: %d rows of %d components on %s, procedure %s", label, *z.shape, device, settings.procedure
    )
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
    best, epochs = record.best.number, record.epochs
    LOGGER.info(
        "%s: best epoch %d of %d run, validation loss %.4f", label, best, len(epochs), record.best_loss
    )
    checkpoints = Checkpoints(
        tuple(
            TrainedEstimator(net, components, number, epochs[number - 1].validation_loss, number == best)
            for number, net in trainer.flows.items()
        )
    )
    return TrainedNetwork(checkpoints.best, losses_table(epochs), checkpoints)


def trainer_of(procedure: Procedure) -> type[SbiTrainer]:
    """Return the class that trains by a procedure of the settings."""
    if procedure == "sbi":
        return SbiTrainer
    # Only here: sbi's own procedure must give the study without the derivatives written by hand.
    from swesbi.networks.paper.accelerated import FastTrainer

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
    """
    available = torch.cuda.is_available()
    if device == "cuda" and not available:
        raise ValueError("device 'cuda' was asked for, but torch finds no CUDA device; use auto or cpu")
    if device == "auto":
        return "cuda" if available and procedure == "sbi" else "cpu"
    return device


def _check_rows(rows: int, settings: EstimatorSettings) -> None:
    held_out = rows - int((1 - settings.validation_fraction) * rows)
    if held_out < 2 or rows - held_out < 2:
        raise ValueError(
            f"{rows} rows cannot be split with validation_fraction = {settings.validation_fraction}; "
            "simulate more draws or change the fraction"
        )
