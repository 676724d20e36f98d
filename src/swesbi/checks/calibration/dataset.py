"""Calibration as datasets, and back; parts and whole have the same groups."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import xarray as xr

from swesbi import artefacts
from swesbi.checks.calibration.fresh import FreshInferred
from swesbi.checks.calibration.ranks import Diagnostics, Inferred, Ranked
from swesbi.context import Context
from swesbi.parameters import PHI_NAMES
from swesbi.population.recordings import ACQUIRED, OWN
from swesbi.recording.observation import context_values, contexts_of
from swesbi.verdict.checks import STRIP_LABELS, Checks

LABELS: Final[dict[str, Any]] = {"parameter": list(PHI_NAMES), **STRIP_LABELS}
TWO_SAMPLES: Final = {
    "accuracy": artefacts.Variable("subject pair", "1", "accuracy of a classifier between two samplers"),
    "draws": artefacts.Variable("subject pair", "1", "draws of each sampler; NaN: not compared"),
}
INFERRED: Final = artefacts.schema_of(Inferred)["/"]
RECORDINGS: Final = {"own": INFERRED, "acquired": INFERRED}
LOCAL: Final = {"local": artefacts.schema_of(Ranked)["/"], "two_samples": TWO_SAMPLES}
REQUIRED: Final[tuple[str | artefacts.Labels, ...]] = (*LABELS, *artefacts.labels_of(Inferred))
RECORDINGS_KIND: Final = artefacts.register("calibration_recordings", RECORDINGS, REQUIRED)
LOCAL_KIND: Final = artefacts.register("calibration_local", LOCAL, REQUIRED)
KIND: Final = artefacts.register("calibration", RECORDINGS | LOCAL, REQUIRED)
JOINED: Final = {"own": "recording", "acquired": "recording", "local": "recording", "two_samples": "subject"}
ALONG: Final = "recording"
OF_FRESH: Final = artefacts.schema_of(Context, ALONG)["/"] | artefacts.schema_of(FreshInferred)["/"]
SCHEMA: Final = artefacts.schema_of(Inferred)["/"] | OF_FRESH
FRESH: Final = artefacts.register("population_calibration", {OWN: SCHEMA, ACQUIRED: SCHEMA}, REQUIRED)
REFUSED: Final = "refused"


def recordings_dataset(recordings: Inferred | Ranked) -> xr.Dataset:
    """Return recordings, with diagnostics or without, as one group."""
    return artefacts.to_dataset(recordings, LABELS)


def two_samples_dataset(subject: str, accuracy: dict[str, float], draws: int) -> xr.Dataset:
    """Return the accuracies of one subject, by pair of samplers."""
    values = {"accuracy": [list(accuracy.values())], "draws": [[float(draws)] * len(accuracy)]}
    return artefacts.build_dataset(TWO_SAMPLES, values, {"subject": [subject], "pair": list(accuracy)})


def join(recordings: Sequence[Path], local_parts: Sequence[Path]) -> dict[str, xr.Dataset]:
    """Put the parts of all subjects together, in the order given, group by group.

    Raises:
        ArtefactError: A file is no such part.
    """
    parts = {
        name: [artefacts.load(path, RECORDINGS_KIND, name)[0] for path in recordings] for name in RECORDINGS
    }
    parts |= {name: [artefacts.load(path, LOCAL_KIND, name)[0] for path in local_parts] for name in LOCAL}
    return {name: xr.concat(datasets, dim=JOINED[name]) for name, datasets in parts.items()}


def ranked_of(dataset: xr.Dataset) -> Ranked:
    """Rebuild recordings and scores from a group."""
    return artefacts.from_dataset(Ranked, dataset)


def diagnostics_of(dataset: xr.Dataset) -> Diagnostics:
    """Rebuild the diagnostics from a group."""
    return artefacts.from_dataset(Diagnostics, dataset)


def checks_of(dataset: xr.Dataset) -> Checks:
    """Rebuild what the tests of the verdict look at from a group."""
    return artefacts.from_dataset(Checks, dataset)


def fresh_dataset(fresh: FreshInferred) -> xr.Dataset:
    """Return the recordings of fresh contexts as one group."""
    added = artefacts.build_dataset(
        OF_FRESH, artefacts.values_of(fresh)["/"] | context_values(fresh.contexts)
    )
    inferred = recordings_dataset(fresh.inferred)
    return inferred.assign(added.variables).assign_attrs({REFUSED: fresh.refused})


def join_fresh(parts: Sequence[Path]) -> dict[str, xr.Dataset]:
    """Put the parts together, in the order given.

    Raises:
        ArtefactError: A file is no such part.
    """
    groups = {}
    for name in (OWN, ACQUIRED):
        loaded = [artefacts.load(path, FRESH, name)[0] for path in parts]
        refused = sum(int(dataset.attrs[REFUSED]) for dataset in loaded)
        groups[name] = xr.concat(loaded, dim="recording").assign_attrs({REFUSED: refused})
    return groups


def fresh_of(dataset: xr.Dataset) -> FreshInferred:
    """Rebuild the recordings of fresh contexts from a group."""
    given = {"contexts": contexts_of(dataset, ALONG), "inferred": artefacts.from_dataset(Inferred, dataset)}
    return artefacts.from_dataset(FreshInferred, dataset, refused=int(dataset.attrs[REFUSED]), **given)
