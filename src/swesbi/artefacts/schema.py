"""Which datasets each kind of artefact holds, with dimensions and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import xarray as xr

from swesbi.artefacts.kinds import SCHEMAS as KINDS
from swesbi.artefacts.variable import Schema, Variable

SCHEMAS: Final[Mapping[str, Schema]] = KINDS


def check_groups(kind: str, groups: Mapping[str, xr.Dataset]) -> None:
    """Compare an artefact's content with the schema of its kind.

    Raises:
        ValueError: The kind is unknown; a group or variable is missing, or has other units or dimensions.
    """
    if kind not in SCHEMAS:
        raise ValueError(f"unknown artefact kind {kind!r}; known: {', '.join(SCHEMAS)}")
    for group, variables in SCHEMAS[kind].items():
        if group not in groups:
            raise ValueError(f"a {kind!r} artefact needs the group {group!r}")
        _check_variables(group, groups[group], variables)


def _check_variables(group: str, dataset: xr.Dataset, variables: Mapping[str, Variable]) -> None:
    if missing := set(variables) - set(dataset.variables):
        raise ValueError(f"group {group!r} lacks {sorted(missing)}")
    for name, expected in variables.items():
        found = dataset[name]
        if tuple(map(str, found.dims)) != expected.dims:
            raise ValueError(f"{group}{name} has dimensions {found.dims}, expected {expected.dims}")
        if found.attrs.get("units") != expected.units:
            raise ValueError(f"{group}{name} has units {found.attrs.get('units')!r}, not {expected.units!r}")
