"""Building a dataset from the schema of its kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from swesbi.artefacts.variable import Variable

if TYPE_CHECKING:
    import xarray as xr


def build_dataset(
    schema: Mapping[str, Variable], values: Mapping[str, Any], labels: Mapping[str, Any] | None = None
) -> xr.Dataset:
    """Return a dataset with the dimensions, units and meanings of one group's schema, and its labels.

    Args:
        schema: Dataset name -> variable, of one group.
        values: Dataset name -> array; names that the schema lacks are left out.
        labels: Label coordinates, as xarray takes them.

    Raises:
        KeyError: A dataset of the schema has no values.
    """
    import xarray as xr  # half a second, which whoever only names an artefact need not wait

    variables = {
        name: (variable.dims, values[name], {"units": variable.units, "long_name": variable.meaning})
        for name, variable in schema.items()
    }
    return xr.Dataset(variables).assign_coords(labels or {})
