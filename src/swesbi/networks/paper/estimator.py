"""The trained density estimator q(theta | z) and its earlier epochs: saving, rebuilding.

A saved estimator is a state_dict with plain metadata, so it loads with ``weights_only=True``: nothing in
the file is executed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from torch import Tensor

from swesbi.artefacts import Provenance
from swesbi.networks import files
from swesbi.networks.paper.maf import MaskedFlow
from swesbi.networks.settings import EstimatorSettings
from swesbi.parameters import THETA_NAMES

ESTIMATOR: Final = "estimator"
CHECKPOINTS: Final = "checkpoints"


@dataclass(frozen=True)
class TrainedEstimator:
    """A trained density estimator and how it was trained.

    Attributes:
        net: The density estimator, on the CPU, with the weights of the best epoch.
        settings: Its architecture and training settings.
        components: The names of its C inputs, in order.
        best_epoch: Epoch of the lowest validation loss, from 1; ``net`` holds its weights.
        epochs_run: Epochs that were trained.
        best_validation_loss: Mean of -log q over the held-out rows at the best epoch.
    """

    net: MaskedFlow
    settings: EstimatorSettings
    components: tuple[str, ...]
    best_epoch: int
    epochs_run: int
    best_validation_loss: float


def save_estimator(path: Path, estimator: TrainedEstimator, provenance: Provenance) -> None:
    """Write the estimator atomically; equal estimators give equal bytes."""
    metadata = {
        **provenance.attributes(),
        **describe_net(estimator.settings, estimator.components),
        "best_epoch": estimator.best_epoch,
        "epochs_run": estimator.epochs_run,
        "best_validation_loss": estimator.best_validation_loss,
    }
    files.write_plain(path, {"metadata": metadata, "state_dict": dict(estimator.net.state_dict())})


def load_estimator(path: Path) -> tuple[TrainedEstimator, Provenance]:
    """Rebuild an estimator from its file, on the CPU, ready to sample.

    Raises:
        ArtefactError: The file is not an estimator that this package can read.
    """
    return files.read_plain(path, ESTIMATOR, _rebuild)


def describe_net(settings: EstimatorSettings, components: tuple[str, ...]) -> dict[str, Any]:
    """Return the plain metadata from which ``rebuild_net`` knows a net's shapes."""
    return {
        "estimator": settings.model_dump_json(),
        "parameters": list(THETA_NAMES),
        "components": list(components),
    }


def rebuild_net(metadata: files.NetMetadata, state: Mapping[str, Tensor]) -> MaskedFlow:
    """Build the net that the metadata describes and give it these weights.

    Raises:
        ValueError: The metadata describe no estimator, or one larger than the weights.
        RuntimeError: Names or shapes of the weights are not the net's.
    """
    settings = metadata.architecture()
    files.check_size(settings, state)
    return MaskedFlow(settings, len(metadata.parameters), len(metadata.components), state)


def _rebuild(content: Mapping[str, Any]) -> TrainedEstimator:
    metadata = files.EstimatorMetadata.from_plain(content["metadata"])
    return TrainedEstimator(
        net=rebuild_net(metadata, content["state_dict"]),
        settings=metadata.architecture(),
        components=metadata.components,
        best_epoch=metadata.best_epoch,
        epochs_run=metadata.epochs_run,
        best_validation_loss=metadata.best_validation_loss,
    )


Weights = tuple[int, float, Mapping[str, Tensor]]
"""Number of an epoch from 1, mean of -log q over the held-out rows after it, its state_dict on the CPU."""


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
        "epochs": [epoch for epoch, _, _ in weights],
        "validation_losses": [loss for _, loss, _ in weights],
    }
    states = {str(epoch): dict(state) for epoch, _, state in weights}
    files.write_plain(path, {"metadata": metadata, "state_dicts": states})


def load_checkpoints(path: Path) -> tuple[tuple[Checkpoint, ...], Provenance]:
    """Rebuild the estimators in the order of their epochs.

    Raises:
        ArtefactError: The file does not hold checkpoints that this package can read.
    """
    return files.read_plain(path, CHECKPOINTS, _rebuild_checkpoint)


def _rebuild_checkpoint(content: Mapping[str, Any]) -> tuple[Checkpoint, ...]:
    metadata, states = files.CheckpointsMetadata.from_plain(content["metadata"]), content["state_dicts"]
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
