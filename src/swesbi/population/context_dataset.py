"""Contexts along a dimension of a dataset, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts.kinds.population import contexts_along
from swesbi.context import Context

NAMES = tuple(contexts_along(""))


def context_values(contexts: Sequence[Context]) -> dict[str, NDArray[np.generic]]:
    """Return the values of the contexts, an array of shape (n,) for each."""
    return {name: np.array([getattr(one, name) for one in contexts]) for name in NAMES}


def contexts_of(dataset: xr.Dataset) -> tuple[Context, ...]:
    """Rebuild the contexts, named by the labels ``subject``."""
    columns = zip(*(dataset[name].to_numpy().tolist() for name in NAMES), strict=True)
    names = dataset["subject"].to_numpy().tolist()
    return tuple(Context(str(name), *row) for name, row in zip(names, columns, strict=True))
