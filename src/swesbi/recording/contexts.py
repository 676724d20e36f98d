"""The contexts of a whole cohort as one artefact, so that comparing a subject with it reads one file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.recording import SCHEMAS
from swesbi.context import Context

KIND: Final = "contexts"
SCHEMA: Final = SCHEMAS[KIND]["/"]


def contexts_dataset(contexts: Sequence[Context]) -> xr.Dataset:
    """Return the artefact's content; subjects in the order given."""
    return build_dataset(
        SCHEMA, {name: np.array([getattr(one, name) for one in contexts]) for name in SCHEMA}
    )


def read_contexts(path: Path) -> tuple[Context, ...]:
    """Read the contexts of a cohort.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    columns = load(path, KIND)[0]
    rows = zip(*(columns[name].to_numpy().tolist() for name in SCHEMA), strict=True)
    return tuple(Context(**dict(zip(SCHEMA, row, strict=True))) for row in rows)
