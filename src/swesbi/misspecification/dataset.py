"""Null distributions and power of one subject as ``misspecification.h5``, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import (
    Labels,
    Part,
    Variable,
    build_dataset,
    from_dataset,
    labels_of,
    load,
    register,
    schema_of,
    values_of,
)
from swesbi.misspecification.bounds import BOUNDS
from swesbi.misspecification.checks import FEATURE_UNITS, Checks
from swesbi.misspecification.reference import Reference, fit_reference
from swesbi.misspecification.settings import RuleSettings
from swesbi.parameters import PHI_NAMES

FloatArray = NDArray[np.float64]
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
        recordings: The checks of each kind of recording; those of the volunteer may be none.
        refused: Recordings of each kind that ingestion refused.
    """

    subject: str
    reference_features: Annotated[
        FloatArray, Variable("reference feature", FEATURE_UNITS, "prior predictive features")
    ]
    feature_names: Annotated[tuple[str, ...], Labels("feature")]
    prior_mass: Annotated[
        FloatArray, Variable("parameter bound", "1", "prior mass in the strip there", "prior_strip_mass")
    ]
    recordings: Mapping[str, Checks]
    refused: Mapping[str, int]

    def reference(self, settings: RuleSettings) -> Reference:
        """Fit the null distributions."""
        null = self.recordings[NULL]
        return fit_reference(null, self.reference_features, self.feature_names, self.prior_mass, settings)


LABELS: Final[dict[str, Any]] = {"parameter": list(PHI_NAMES), "bound": list(BOUNDS)}
SEEN: Final = Part(words={"features": "features S(.) as the network sees them", "bound": " there"})
RECORDED: Final = SEEN.place_all(schema_of(Checks)["/"])
ROOT: Final = schema_of(SubjectChecks)["/"] | {
    "refused": Variable("kind_of_recording", "1", "recordings that ingestion refused")
}
KIND: Final = register(
    "misspecification",
    {"/": ROOT, **dict.fromkeys(KINDS, RECORDED)},
    (*LABELS, *labels_of(SubjectChecks), "kind_of_recording"),
)


def to_groups(checks: SubjectChecks) -> dict[str, xr.Dataset]:
    """Return the groups of ``misspecification.h5``."""
    values = values_of(checks)["/"] | {"refused": np.array([checks.refused[kind] for kind in KINDS])}
    labels = {**LABELS, "feature": list(checks.feature_names), "kind_of_recording": list(KINDS)}
    of_kind = {
        kind: build_dataset(RECORDED, values_of(checks.recordings[kind])["/"], labels) for kind in KINDS
    }
    return {"/": build_dataset(ROOT, values, labels), **of_kind}


def read_subject_checks(path: Path, kinds: Sequence[str] = KINDS) -> SubjectChecks:
    """Read ``misspecification.h5``, or of its recordings those of some kinds alone.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, provenance = load(path, KIND)
    return from_dataset(
        SubjectChecks,
        root,
        subject=provenance.subject,
        recordings={kind: from_dataset(Checks, load(path, KIND, kind)[0]) for kind in kinds},
        refused={kind: int(n) for kind, n in zip(KINDS, root["refused"].to_numpy(), strict=True)},
    )
