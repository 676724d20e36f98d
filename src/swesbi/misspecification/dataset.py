"""Null distributions and power of one subject as ``misspecification.h5``, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.misspecification import SCHEMAS
from swesbi.misspecification.bounds import BOUNDS
from swesbi.misspecification.checks import Checks
from swesbi.misspecification.reference import Reference, fit_reference
from swesbi.misspecification.settings import RuleSettings
from swesbi.parameters import PHI_NAMES

FloatArray = NDArray[np.float64]
KIND: Final = "misspecification"
NULL: Final = "null"
OWN: Final = "own"
ACQUIRED: Final = "acquired"
VOLUNTEER: Final = "volunteer"
KINDS: Final = (NULL, OWN, ACQUIRED, VOLUNTEER)
"""Recordings of a subject: two well-specified sets under the model's own noise, of which the first makes
the null; one recorded sample by sample; the virtual volunteer recorded anew."""


@dataclass(frozen=True)
class SubjectChecks:
    """What the tests look at in all synthetic recordings of one subject.

    Attributes:
        subject: Its name.
        reference_features: Features of prior predictive recordings; shape (m, F).
        feature_names: Their names.
        prior_mass: Mass of the prior in the strip at each bound; shape (4, 2).
        recordings: The checks of each kind of recording; those of the volunteer may be none.
        refused: Recordings of each kind that ingestion refused.
    """

    subject: str
    reference_features: FloatArray
    feature_names: tuple[str, ...]
    prior_mass: FloatArray
    recordings: Mapping[str, Checks]
    refused: Mapping[str, int]

    def reference(self, settings: RuleSettings) -> Reference:
        """Fit the null distributions."""
        null = self.recordings[NULL]
        return fit_reference(null, self.reference_features, self.feature_names, self.prior_mass, settings)


def to_groups(checks: SubjectChecks) -> dict[str, xr.Dataset]:
    """Return the groups of ``misspecification.h5``."""
    schema = SCHEMAS[KIND]
    values = {
        "reference_features": checks.reference_features,
        "prior_strip_mass": checks.prior_mass,
        "refused": np.array([checks.refused[kind] for kind in KINDS]),
    }
    bounds = {"parameter": list(PHI_NAMES), "bound": list(BOUNDS)}
    features = {"feature": list(checks.feature_names)}
    root = build_dataset(schema["/"], values, {**bounds, **features, "kind_of_recording": list(KINDS)})
    of_kind = {
        kind: build_dataset(schema[kind], _columns(checks.recordings[kind]), {**bounds, **features})
        for kind in KINDS
    }
    return {"/": root, **of_kind}


def read_subject_checks(path: Path, kinds: Sequence[str] = KINDS) -> SubjectChecks:
    """Read ``misspecification.h5``, or of its recordings those of some kinds alone.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, provenance = load(path, KIND)
    return SubjectChecks(
        subject=provenance.subject,
        reference_features=root["reference_features"].to_numpy(),
        feature_names=tuple(map(str, root["feature"].to_numpy())),
        prior_mass=root["prior_strip_mass"].to_numpy(),
        recordings={kind: _checks(load(path, KIND, kind)[0]) for kind in kinds},
        refused={kind: int(n) for kind, n in zip(KINDS, root["refused"].to_numpy(), strict=True)},
    )


def _columns(checks: Checks) -> dict[str, FloatArray]:
    return {field.name: getattr(checks, field.name) for field in fields(Checks)}


def _checks(group: xr.Dataset) -> Checks:
    return Checks(**{field.name: group[field.name].to_numpy() for field in fields(Checks)})
