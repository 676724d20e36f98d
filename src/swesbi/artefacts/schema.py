"""What an artefact holds, said once: dimensions, units and meaning on the fields of its dataclasses.

A new dataset of an artefact is one line in one dataclass, a field or, where it is computed, a property::

    wall_stress_kpa: Annotated[FloatArray, Variable("simulation cycle", "kPa", "circumferential wall stress")]

Writing, reading, and the check of both follow from it. Text labels are marked :class:`Labels`, dataclasses
within a dataclass :class:`Part`; a field without a mark is not stored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from swesbi.artefacts.groups import Array, Group
from swesbi.parameters import THETA_NAMES

NUMERIC: Final = "biuf"
TEXT: Final = "OSUT"
PARAMETER: Final = "parameter"


@dataclass(frozen=True)
class Variable:
    """One dataset of an artefact.

    Attributes:
        along: Its dimensions, separated by spaces; a dataset named as its only dimension is its labels.
        units: In UDUNITS notation, or words.
        meaning: In words; ``{name}`` stands for what a :class:`Part` says.
        name: Of the dataset, where it is not the field's.
        group: Where it is not the one of the other datasets.
        after: Name of the dataset that it follows, where it does not lie in the order of the fields.
        text: Whether it holds text; told by the type of a field.
    """

    along: str
    units: str
    meaning: str
    name: str = ""
    group: str = ""
    after: str = ""
    text: bool = False

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimensions."""
        return tuple(self.along.split())


@dataclass(frozen=True)
class Labels:
    """Text labels of a dimension, which readers need.

    Attributes:
        along: The dimension.
        name: Where it is not the dimension's.
        group: The only one that has them; empty: all groups that have the dimension.
    """

    along: str
    name: str = ""
    group: str = ""


@dataclass(frozen=True)
class Part:
    """A dataclass within another, whose datasets lie beside the others.

    Attributes:
        name: Pattern of the datasets' names, ``{}`` for the name within the part.
        along: Dimensions before those of the part.
        units: In place of those within the part, where given.
        group: Of datasets that name none.
        words: What stands for the names in braces in the meanings.
    """

    name: str = "{}"
    along: str = ""
    units: str = ""
    group: str = ""
    words: Mapping[str, str] = field(default_factory=dict)

    def place(self, variable: Variable) -> Variable:
        """Return a variable of the part as it lies in the artefact."""
        return replace(
            variable,
            along=f"{self.along} {variable.along}".strip(),
            units=self.units or variable.units,
            meaning=variable.meaning.format_map(self.words) if self.words else variable.meaning,
            name=self.name.format(variable.name),
            group=variable.group or self.group,
        )

    def place_all(self, variables: Mapping[str, Variable]) -> dict[str, Variable]:
        """Return the variables of one group as they lie in the artefact."""
        return {placed.name: placed for placed in map(self.place, variables.values())}


Schema = Mapping[str, Mapping[str, Variable]]
"""Of one kind of artefact: group name -> dataset name -> variable; the group "/" is the root."""


def arranged(variables: Mapping[str, Variable]) -> dict[str, Variable]:
    """Return variables in order, those that say so right behind another."""
    names = list(variables)
    for name, variable in variables.items():
        if variable.after:
            names.remove(name)
            names.insert(names.index(variable.after) + 1, name)
    return {name: variables[name] for name in names}


def build_group(
    schema: Mapping[str, Variable], values: Mapping[str, Any], labels: Mapping[str, Any] | None = None
) -> Group:
    """Return a group with the dimensions, units and meanings of its schema, and its labels.

    Args:
        schema: Dataset name -> variable, of one group.
        values: Dataset name -> array; names that the schema lacks are left out.
        labels: Labels by name: along the dimension of this name, or with the dimension before them. Those
            along other dimensions than the group's are left out.

    Raises:
        KeyError: A dataset of the schema has no values.
    """
    arrays = {
        name: Array(
            variable.dims, np.asarray(values[name]), {"units": variable.units, "long_name": variable.meaning}
        )
        for name, variable in schema.items()
    }
    dims = {dim for array in arrays.values() for dim in array.dims}
    placed = {
        name: label if isinstance(label, tuple) else (name, label) for name, label in (labels or {}).items()
    }
    added = {
        # an empty list would become an array of numbers
        name: Array((along,), np.asarray(label) if len(label) else np.array([], str), {"units": "1"})
        for name, (along, label) in placed.items()
        if along in dims
    }
    own = {name for name, array in arrays.items() if array.dims == (name,)}
    return Group(arrays | added, frozenset(own | added.keys()))


def check_group(
    name: str, group: Group, variables: Mapping[str, Variable], required: Sequence[Labels]
) -> None:
    """Compare one group with what is said of it.

    Args:
        name: Of the group.
        group: What it holds, other datasets perhaps among them.
        variables: Dataset name -> variable.
        required: Text labels that it needs if it has their dimension.

    Raises:
        ValueError: A variable or a label is missing, or has other units, dimensions or another type.
    """
    if missing := set(variables) - set(group):
        raise ValueError(f"group {name!r} lacks {sorted(missing)}")
    for own, expected in variables.items():
        _check_variable(f"{name.rstrip('/')}/{own}", group[own], expected)
    dimensions = {dimension for variable in variables.values() for dimension in variable.dims}
    for labels in required:
        own = labels.name or labels.along
        has_labels = own in group.labels and group[own].values.dtype.kind in TEXT
        if labels.along in dimensions and not has_labels:
            raise ValueError(f"group {name!r} lacks the labels {own!r}")
    _check_parameters(name, group)


def _check_variable(name: str, array: Array, expected: Variable) -> None:
    if array.dims != expected.dims:
        raise ValueError(f"{name} has dimensions {array.dims}, expected {expected.dims}")
    if array.attrs.get("units") != expected.units:
        raise ValueError(f"{name} has units {array.attrs.get('units')!r}, not {expected.units!r}")
    is_label = expected.dims == (name.rpartition("/")[2],)
    kind = array.values.dtype.kind
    if kind not in (TEXT if expected.text else NUMERIC) and not is_label:
        wanted = "text" if expected.text else "numbers"
        raise ValueError(f"{name} holds {array.values.dtype}, expected {wanted}")


def _check_parameters(group: str, dataset: Group) -> None:
    """Columns of theta are taken by position, so their labels have to be the parameters in order."""
    if PARAMETER not in dataset.labels:
        return
    names = tuple(map(str, dataset[PARAMETER].values))
    if names[: len(THETA_NAMES)] != THETA_NAMES:
        raise ValueError(f"group {group!r} has parameters {list(names)}, expected {list(THETA_NAMES)}")
