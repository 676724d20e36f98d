"""The trained flow as ``estimator.pt``: a state_dict with plain metadata, nothing to execute."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from swesbi.artefacts import Provenance
from swesbi.networks.determinism import reproducible
from swesbi.networks.files import read_plain, write_plain
from swesbi.networks.settings import SplineSettings
from swesbi.networks.spline import cells, conditioning
from swesbi.networks.spline.net import TrainedSpline, build_net
from swesbi.networks.standardisation import Standardisation
from swesbi.prior import JointPriorSettings

KIND: Final = "flow"
FEATURES: Final = "features"
CELLS: Final = "cells"


def save_spline(path: Path, spline: TrainedSpline, provenance: Provenance) -> None:
    """Write the flow atomically; equal flows give equal bytes."""
    metadata = {
        **provenance.attributes(),
        "flow": spline.settings.model_dump_json(),
        "prior": spline.prior.model_dump_json(),
        "parameters": list(spline.prior.names),
        "components": list(spline.components),
        **_conditioner_metadata(spline.conditioner),
        **_statistics_metadata(eta=spline.eta),
        "best_epoch": spline.best_epoch,
        "epochs_run": spline.epochs_run,
        "best_validation_loss": spline.best_validation_loss,
    }
    write_plain(path, {"metadata": metadata, "state_dict": dict(spline.net.state_dict())})


def load_spline(path: Path) -> tuple[TrainedSpline, Provenance]:
    """Rebuild a flow from its file, on the CPU, ready to draw.

    Raises:
        ArtefactError: The file is not a flow that this package can read.
    """
    return read_plain(path, KIND, _rebuild)


def load_spline_provenance(path: Path) -> Provenance:
    """Return how a flow was made, without building it.

    Raises:
        ArtefactError: The file is not a flow that this package can read.
    """
    return read_plain(path, KIND, dict)[1]


def _rebuild(content: Mapping[str, Any]) -> TrainedSpline:
    metadata = content["metadata"]
    settings = SplineSettings.model_validate_json(metadata["flow"])
    with reproducible(0):
        net = build_net(settings, len(metadata["parameters"]), len(metadata["components"]))
    net.load_state_dict(dict(content["state_dict"]))
    net.eval()
    return TrainedSpline(
        net=net,
        settings=settings,
        prior=JointPriorSettings.model_validate_json(metadata["prior"]),
        conditioner=_conditioner(metadata),
        eta=_statistics(metadata, "eta"),
        best_epoch=metadata["best_epoch"],
        epochs_run=metadata["epochs_run"],
        best_validation_loss=metadata["best_validation_loss"],
    )


def _conditioner_metadata(conditioner: conditioning.RecordingConditioner) -> dict[str, object]:
    """Return kind, settings and statistics of a conditioner.

    Raises:
        TypeError: It is of no kind that can be written.
    """
    if isinstance(conditioner, conditioning.Conditioner):
        statistics = {"features": conditioner.features, "context": conditioner.context}
        return _described(FEATURES, conditioner.settings.model_dump_json(), statistics)
    if isinstance(conditioner, cells.CellConditioner):
        return _described(CELLS, conditioner.settings.model_dump_json(), {"inputs": conditioner.inputs})
    raise TypeError(f"{type(conditioner).__name__} is no conditioner that a file can hold")


def _described(kind: str, settings: str, statistics: Mapping[str, Standardisation]) -> dict[str, object]:
    return {"conditioner": kind, "conditioning": settings, **_statistics_metadata(**statistics)}


def _conditioner(metadata: Mapping[str, Any]) -> conditioning.RecordingConditioner:
    if metadata["conditioner"] == CELLS:
        settings = cells.CellSettings.model_validate_json(metadata["conditioning"])
        return cells.CellConditioner(settings, _statistics(metadata, "inputs"))
    return conditioning.Conditioner(
        conditioning.ConditioningSettings.model_validate_json(metadata["conditioning"]),
        _statistics(metadata, "features"),
        _statistics(metadata, "context"),
    )


def _statistics_metadata(**statistics: Standardisation) -> dict[str, list[float]]:
    means = {f"{name}_mean": values.mean.tolist() for name, values in statistics.items()}
    return means | {f"{name}_scale": values.scale.tolist() for name, values in statistics.items()}


def _statistics(metadata: Mapping[str, Any], name: str) -> Standardisation:
    return Standardisation(np.array(metadata[f"{name}_mean"]), np.array(metadata[f"{name}_scale"]))
