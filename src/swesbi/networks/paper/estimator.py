"""The trained density estimator q(theta | z) and its earlier epochs: saving, rebuilding.

A saved estimator is a state_dict with plain metadata, so it loads with ``weights_only=True``: nothing in
the file is executed.
"""

from __future__ import annotations

from collections.abc import Mapping
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

    @classmethod
    def read(cls, path: Path) -> TrainedEstimator:
        """Rebuild an estimator from its file, on the CPU, ready to sample.

        Raises:
            ArtefactError: The file is not an estimator that this package can read.
        """
        return files.read_plain(path, ESTIMATOR, _rebuild)

    def write(self, path: Path, made: Provenance) -> None:
        """Write the estimator atomically; equal estimators give equal bytes."""
        metadata = {
            **made.of(ESTIMATOR).attributes(),
            **describe_net(self.settings, self.components),
            "best_epoch": self.best_epoch,
            "epochs_run": self.epochs_run,
            "best_validation_loss": self.best_validation_loss,
        }
        files.write_plain(path, {"metadata": metadata, "state_dict": dict(self.net.state_dict())})


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


@dataclass(frozen=True)
class Checkpoints:
    """The density estimator after several epochs of one training, its best and its last among them.

    Attributes:
        settings: Architecture and training settings.
        of_epochs: In the order of the epochs.
    """

    settings: EstimatorSettings
    of_epochs: tuple[Checkpoint, ...]

    @property
    def best(self) -> Checkpoint:
        """That of the lowest validation loss."""
        return next(one for one in self.of_epochs if one.best)

    @classmethod
    def read(cls, path: Path) -> Checkpoints:
        """Rebuild the estimators.

        Raises:
            ArtefactError: The file does not hold checkpoints that this package can read.
        """
        return files.read_plain(path, CHECKPOINTS, _rebuild_checkpoints)

    def write(self, path: Path, made: Provenance) -> None:
        """Write the weights of all epochs atomically; equal ones give equal bytes."""
        metadata = {
            **made.of(CHECKPOINTS).attributes(),
            **describe_net(self.settings, self.best.components),
            "best_epoch": self.best.epoch,
            "epochs": [one.epoch for one in self.of_epochs],
            "validation_losses": [one.validation_loss for one in self.of_epochs],
        }
        states = {str(one.epoch): dict(one.net.state_dict()) for one in self.of_epochs}
        files.write_plain(path, {"metadata": metadata, "state_dicts": states})


def _rebuild_checkpoints(content: Mapping[str, Any]) -> Checkpoints:
    metadata, states = files.CheckpointsMetadata.from_plain(content["metadata"]), content["state_dicts"]
    settings = metadata.architecture()
    return Checkpoints(
        settings,
        tuple(
            Checkpoint(
                epoch=epoch,
                validation_loss=loss,
                best=epoch == metadata.best_epoch,
                components=metadata.components,
                net=rebuild_net(metadata, states[str(epoch)]),
            )
            for epoch, loss in zip(metadata.epochs, metadata.validation_losses, strict=True)
        ),
    )
