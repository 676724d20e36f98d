"""Building a dataset from the schema of its kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr

from swesbi.artefacts.variable import Variable


def build(schema: Mapping[str, Variable], values: Mapping[str, Any], labels: Mapping[str, Any]) -> xr.Dataset:
    """Return a dataset with the dimensions, units and meanings of the schema, and label coordinates."""
    variables = {
        name: (variable.dims, values[name], {"units": variable.units, "long_name": variable.meaning})
        for name, variable in schema.items()
    }
    return xr.Dataset(variables).assign_coords(labels)
