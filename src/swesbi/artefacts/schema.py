"""Which datasets each kind of artefact holds, with dimensions, units and labels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from swesbi.artefacts.kinds import LABELS
from swesbi.artefacts.kinds import SCHEMAS as KINDS
from swesbi.artefacts.variable import Schema, Variable
from swesbi.parameters import THETA_NAMES

if TYPE_CHECKING:
    import xarray as xr

SCHEMAS: Final[Mapping[str, Schema]] = KINDS
NUMERIC: Final = "biuf"
TEXT: Final = "OSUT"
PARAMETER: Final = "parameter"


def check_groups(kind: str, groups: Mapping[str, xr.Dataset]) -> None:
    """Compare an artefact's content with the schema of its kind.

    Raises:
        ValueError: The kind is unknown, a group is missing, or one differs from its schema.
    """
    if kind not in SCHEMAS:
        raise ValueError(f"unknown artefact kind {kind!r}; known: {', '.join(SCHEMAS)}")
    for group in SCHEMAS[kind]:
        if group not in groups:
            raise ValueError(f"a {kind!r} artefact needs the group {group!r}")
        check_group(kind, group, groups[group])


def check_group(kind: str, group: str, dataset: xr.Dataset) -> None:
    """Compare one group with the schema of its kind; a group that the schema does not name is free.

    Raises:
        ValueError: A variable or a label is missing, or has other units, dimensions or another type.
    """
    variables = SCHEMAS.get(kind, {}).get(group, {})
    if missing := set(variables) - set(dataset.variables):
        raise ValueError(f"group {group!r} lacks {sorted(missing)}")
    for name, expected in variables.items():
        _check_variable(f"{group.rstrip('/')}/{name}", dataset[name], expected)
    for name in LABELS.get(kind, {}).get(group, ()):
        if name not in dataset.coords or dataset[name].dtype.kind not in TEXT:
            raise ValueError(f"group {group!r} lacks the labels {name!r}")
    _check_parameters(group, dataset)


def _check_variable(name: str, found: xr.DataArray, expected: Variable) -> None:
    if tuple(map(str, found.dims)) != expected.dims:
        raise ValueError(f"{name} has dimensions {found.dims}, expected {expected.dims}")
    if found.attrs.get("units") != expected.units:
        raise ValueError(f"{name} has units {found.attrs.get('units')!r}, not {expected.units!r}")
    is_label = expected.dims == (found.name,)
    if found.dtype.kind not in (TEXT if expected.text else NUMERIC) and not is_label:
        raise ValueError(f"{name} holds {found.dtype}, expected {'text' if expected.text else 'numbers'}")


def _check_parameters(group: str, dataset: xr.Dataset) -> None:
    """Columns of theta are taken by position, so their labels have to be the parameters in order."""
    if PARAMETER not in dataset.coords:
        return
    names = tuple(map(str, dataset[PARAMETER].to_numpy()))
    if names[: len(THETA_NAMES)] != THETA_NAMES:
        raise ValueError(f"group {group!r} has parameters {list(names)}, expected {list(THETA_NAMES)}")
