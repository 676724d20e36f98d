"""Predictive checks as HDF5 artefacts: dataclass to datasets and back."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from swesbi.artefacts import Provenance, build_dataset, load
from swesbi.artefacts.kinds.evaluation import SCHEMAS
from swesbi.evaluation.features import FeatureCheck
from swesbi.evaluation.predictive import Draws, Prediction, PredictiveCheck, Target
from swesbi.evaluation.scores import Band, Scores
from swesbi.parameters import THETA_NAMES

KIND = "predictive"
SCHEMA = SCHEMAS[KIND]
ROOT_SCALARS = ("interval", "supported")
VOLUMES = ("lvedv_ml", "lvesv_ml")
SCORE_NAMES = tuple(field.name for field in fields(Scores))


def to_datasets(check: PredictiveCheck) -> dict[str, xr.Dataset]:
    """Return the root, prior and posterior groups of a predictive artefact."""
    target = check.target
    values = {name: getattr(target, name) for name in SCHEMA["/"] if name not in ROOT_SCALARS}
    values["measured"] = target.measured.astype(np.int8)
    values |= {"interval": check.interval, "supported": np.int8(check.supported)}
    labels = {"feature": list(target.feature_names)}
    prediction_labels = labels | {"parameter": list(THETA_NAMES)}
    return {
        "/": build_dataset(SCHEMA["/"], values, labels),
        "prior": build_dataset(SCHEMA["prior"], _flat(check.prior), prediction_labels),
        "posterior": build_dataset(SCHEMA["posterior"], _flat(check.posterior), prediction_labels),
    }


def read_predictive(path: Path) -> tuple[PredictiveCheck, Provenance]:
    """Read a predictive artefact.

    Raises:
        ArtefactError: The file is no predictive artefact of this schema version.
    """
    root, provenance = load(path, KIND)
    values: dict[str, Any] = {name: root[name].to_numpy() for name in _target_arrays()}
    values |= {name: root[name].item() for name in VOLUMES}
    target = Target(
        **values,
        measured=root["measured"].to_numpy().astype(bool),
        feature_names=tuple(map(str, root["feature"].to_numpy())),
    )
    prior, posterior = (_prediction(load(path, KIND, group)[0], target) for group in ("prior", "posterior"))
    return PredictiveCheck(
        target, root["interval"].item(), bool(root["supported"]), prior, posterior
    ), provenance


def _target_arrays() -> list[str]:
    others = ("measured", "feature_names", *VOLUMES)
    return [field.name for field in fields(Target) if field.name not in others]


def _flat(prediction: Prediction) -> dict[str, Any]:
    """Spread a prediction's parts over the names of the schema."""
    flat: dict[str, Any] = {field.name: getattr(prediction.draws, field.name) for field in fields(Draws)}
    bands = {"curve": prediction.curve, "phase": prediction.phases, "feature": prediction.features.predicted}
    for name, band in bands.items():
        unit = "" if name == "feature" else "_kpa"
        flat |= {f"{name}_{part}{unit}": getattr(band, part) for part in ("median", "low", "high")}
    for name in SCORE_NAMES:
        flat[name] = getattr(prediction.scores, name)
        flat[f"phases_{name}"] = getattr(prediction.phase_scores, name)
    flat["ejection_fraction"] = prediction.draws.ejection_fraction
    return flat | {"coverage_recording_noise": prediction.coverage_recording_noise}


def _prediction(group: xr.Dataset, target: Target) -> Prediction:
    def band(name: str, unit: str = "_kpa") -> Band:
        return Band(*[group[f"{name}_{part}{unit}"].to_numpy() for part in ("median", "low", "high")])

    def scores(prefix: str = "") -> Scores:
        return Scores(*[float(group[prefix + name]) for name in SCORE_NAMES])

    arrays = {field.name: group[field.name].to_numpy() for field in fields(Draws) if field.name != "failed"}
    return Prediction(
        draws=Draws(**arrays, failed=int(group["failed"])),
        curve=band("curve"),
        phases=band("phase"),
        features=FeatureCheck(target.features, band("feature", "")),
        scores=scores(),
        phase_scores=scores("phases_"),
        coverage_recording_noise=float(group["coverage_recording_noise"]),
    )
