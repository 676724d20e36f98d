"""Calibration as datasets, and back; the parts of single subjects and the whole have the same groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.calibration import DIAGNOSTICS, LOCAL, RANKED, RECORDINGS
from swesbi.calibration.quantities import QUANTITY_NAMES
from swesbi.calibration.ranked import SAMPLERS, Diagnostics, Inferred, Ranked
from swesbi.calibration.scores import Scores
from swesbi.parameters import PHI_NAMES

RECORDINGS_KIND: Final = "calibration_recordings"
LOCAL_KIND: Final = "calibration_local"
KIND: Final = "calibration"
JOINED: Final = {"own": "recording", "acquired": "recording", "local": "recording", "two_samples": "subject"}
SCORE_FIELDS: Final = ("level", "tarp", "mean", "sd")


def inferred_dataset(inferred: Inferred) -> xr.Dataset:
    """Return recordings and diagnostics as one group."""
    values = _ranked_values(inferred.ranked) | asdict(inferred.diagnostics)
    values["by_mcmc"] = inferred.diagnostics.by_mcmc.astype(np.int8)
    labels = _labels(inferred.ranked) | {"parameter": list(PHI_NAMES), "bound": ["lower", "upper"]}
    return build_dataset(RANKED | DIAGNOSTICS, values, labels)


def ranked_dataset(ranked: Ranked) -> xr.Dataset:
    """Return recordings without diagnostics as one group."""
    return build_dataset(RANKED, _ranked_values(ranked), _labels(ranked))


def two_samples_dataset(subject: str, accuracy: dict[str, float], draws: int) -> xr.Dataset:
    """Return the accuracies of one subject, by pair of samplers."""
    values = {"accuracy": [list(accuracy.values())], "draws": [draws]}
    return build_dataset(LOCAL["two_samples"], values, {"subject": [subject], "pair": list(accuracy)})


def join(recordings: Sequence[Path], local_parts: Sequence[Path]) -> dict[str, xr.Dataset]:
    """Put the parts of all subjects together, in the order given, group by group.

    Raises:
        ArtefactError: A file is no such part.
    """
    parts = {name: [load(path, RECORDINGS_KIND, name)[0] for path in recordings] for name in RECORDINGS}
    parts |= {name: [load(path, LOCAL_KIND, name)[0] for path in local_parts] for name in LOCAL}
    return {name: xr.concat(datasets, dim=JOINED[name]) for name, datasets in parts.items()}


def ranked_of(dataset: xr.Dataset) -> Ranked:
    """Rebuild recordings and scores from a group."""
    network, weighted = (
        Scores(*(dataset[f"{sampler}_{name}"].to_numpy() for name in SCORE_FIELDS)) for sampler in SAMPLERS
    )
    return Ranked(
        subject=dataset["subject"].to_numpy().astype(str),
        truth=dataset["truth"].to_numpy(),
        prior_variance=dataset["prior_variance"].to_numpy(),
        network=network,
        weighted=weighted,
    )


def diagnostics_of(dataset: xr.Dataset) -> Diagnostics:
    """Rebuild the diagnostics from a group."""
    arrays: dict[str, Any] = {name: dataset[name].to_numpy() for name in DIAGNOSTICS}
    arrays["by_mcmc"] = arrays["by_mcmc"].astype(bool)
    return Diagnostics(**arrays)


def _ranked_values(ranked: Ranked) -> dict[str, Any]:
    values: dict[str, Any] = {"truth": ranked.truth, "prior_variance": ranked.prior_variance}
    for sampler in SAMPLERS:
        scores = ranked.of(sampler)
        values |= {f"{sampler}_{name}": getattr(scores, name) for name in SCORE_FIELDS}
    return values


def _labels(ranked: Ranked) -> dict[str, Any]:
    return {"quantity": list(QUANTITY_NAMES), "subject": ("recording", ranked.subject)}
