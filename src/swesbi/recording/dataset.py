"""The observed curve of a subject and the contexts of a whole cohort as artefacts, and back.

The contexts are a file of their own, so that comparing a subject with the cohort reads one file.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import (
    Variable,
    build_dataset,
    from_groups,
    from_rows,
    load,
    register,
    schema_of,
    stacked_values,
)
from swesbi.context import Context
from swesbi.recording.observation import Observation

KIND: Final = register("observation", schema_of(Observation))
SUBJECTS: Final = {"subject": Variable("subject", "1", "subjects of the cohort")}
COHORT: Final = SUBJECTS | schema_of(Context, along="subject")["/"]
CONTEXTS: Final = register("contexts", {"/": COHORT})


def read_observation(path: Path) -> Observation:
    """Read the observed curve of one subject.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, provenance = load(path, KIND)
    groups = {"/": root, "context": load(path, KIND, "context")[0]}
    return from_groups(Observation, groups, {"context.subject": provenance.subject})


def contexts_dataset(contexts: Sequence[Context]) -> xr.Dataset:
    """Return the contexts of a cohort as an artefact's content; subjects in the order given."""
    names = np.array([one.subject for one in contexts])
    return build_dataset(COHORT, {"subject": names, **context_values(contexts)})


def read_contexts(path: Path) -> tuple[Context, ...]:
    """Read the contexts of a cohort.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    return contexts_of(load(path, CONTEXTS)[0], "subject")


def context_values(contexts: Sequence[Context]) -> dict[str, NDArray[np.generic]]:
    """Return the values of the contexts, an array of shape (n,) for each."""
    return stacked_values(contexts)["/"]


def contexts_of(dataset: xr.Dataset, along: str) -> tuple[Context, ...]:
    """Rebuild the contexts along a dimension, named by the labels ``subject``."""
    names = [str(name) for name in dataset["subject"].to_numpy()]
    return tuple(from_rows(Context, dataset, along, subject=names))
