"""The estimator as it was after selected epochs of one training, and the file that keeps them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from torch import Tensor

from swesbi.artefacts import Provenance
from swesbi.inference.estimator import describe_net, rebuild_net
from swesbi.inference.maf import MaskedFlow
from swesbi.inference.net_metadata import CheckpointsMetadata
from swesbi.inference.settings import EstimatorSettings
from swesbi.inference.torch_files import read_plain, write_plain

KIND: Final = "checkpoints"


@dataclass(frozen=True)
class Weights:
    """The weights after one epoch, on the CPU.

    Attributes:
        epoch: Number of the epoch, from 1.
        validation_loss: Mean of -log q over the held-out rows after it.
        state: The state_dict.
    """

    epoch: int
    validation_loss: float
    state: Mapping[str, Tensor]


@dataclass(frozen=True)
class Checkpoint:
    """The density estimator after one epoch, ready to sample.

    Attributes:
        epoch: Number of the epoch, from 1.
        validation_loss: Mean of -log q over the held-out rows after it.
        best: Its validation loss is the lowest of the whole training: the estimator that the study uses.
        components: The names of the net's C inputs, in order.
        net: The density estimator.
    """

    epoch: int
    validation_loss: float
    best: bool
    components: tuple[str, ...]
    net: MaskedFlow


def save_checkpoints(
    path: Path,
    weights: Sequence[Weights],
    best_epoch: int,
    settings: EstimatorSettings,
    components: tuple[str, ...],
    provenance: Provenance,
) -> None:
    """Write the weights of several epochs of one training atomically; equal ones give equal bytes."""
    metadata = {
        **provenance.attributes(),
        **describe_net(settings, components),
        "best_epoch": best_epoch,
        "epochs": [one.epoch for one in weights],
        "validation_losses": [one.validation_loss for one in weights],
    }
    states = {str(one.epoch): dict(one.state) for one in weights}
    write_plain(path, {"metadata": metadata, "state_dicts": states})


def load_checkpoints(path: Path) -> tuple[tuple[Checkpoint, ...], Provenance]:
    """Rebuild the estimators in the order of their epochs.

    Raises:
        ArtefactError: The file does not hold checkpoints that this package can read.
    """
    return read_plain(path, KIND, _rebuild)


def _rebuild(content: Mapping[str, Any]) -> tuple[Checkpoint, ...]:
    metadata, states = CheckpointsMetadata.from_plain(content["metadata"]), content["state_dicts"]
    return tuple(
        Checkpoint(
            epoch=epoch,
            validation_loss=loss,
            best=epoch == metadata.best_epoch,
            components=metadata.components,
            net=rebuild_net(metadata, states[str(epoch)]),
        )
        for epoch, loss in zip(metadata.epochs, metadata.validation_losses, strict=True)
    )
