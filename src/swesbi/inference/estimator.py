"""The trained conditional density estimator q(theta | z): saving, rebuilding.

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
from swesbi.inference.maf import MaskedFlow
from swesbi.inference.net_metadata import EstimatorMetadata, NetMetadata, check_size
from swesbi.inference.settings import EstimatorSettings
from swesbi.inference.torch_files import read_plain, write_plain
from swesbi.parameters import THETA_NAMES

KIND: Final = "estimator"


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
    write_plain(path, {"metadata": metadata, "state_dict": dict(estimator.net.state_dict())})


def load_estimator(path: Path) -> tuple[TrainedEstimator, Provenance]:
    """Rebuild an estimator from its file, on the CPU, ready to sample.

    Raises:
        ArtefactError: The file is not an estimator that this package can read.
    """
    return read_plain(path, KIND, _rebuild)


def describe_net(settings: EstimatorSettings, components: tuple[str, ...]) -> dict[str, Any]:
    """Return the plain metadata from which ``rebuild_net`` knows a net's shapes."""
    return {
        "estimator": settings.model_dump_json(),
        "parameters": list(THETA_NAMES),
        "components": list(components),
    }


def rebuild_net(metadata: NetMetadata, state: Mapping[str, Tensor]) -> MaskedFlow:
    """Build the net that the metadata describes and give it these weights.

    Raises:
        ValueError: The metadata describe no estimator, or one larger than the weights.
        RuntimeError: Names or shapes of the weights are not the net's.
    """
    settings = metadata.architecture()
    check_size(settings, state)
    return MaskedFlow(settings, len(metadata.parameters), len(metadata.components), state)


def _rebuild(content: Mapping[str, Any]) -> TrainedEstimator:
    metadata = EstimatorMetadata.from_plain(content["metadata"])
    return TrainedEstimator(
        net=rebuild_net(metadata, content["state_dict"]),
        settings=metadata.architecture(),
        components=metadata.components,
        best_epoch=metadata.best_epoch,
        epochs_run=metadata.epochs_run,
        best_validation_loss=metadata.best_validation_loss,
    )
