"""What an artefact holds, said once: dimensions, units and meaning on the fields of its dataclasses.

A new dataset of an artefact is one line in one dataclass, a field or, where it is computed, a property::

    wall_stress_kpa: Annotated[FloatArray, Variable("simulation cycle", "kPa", "circumferential wall stress")]

Writing, reading, and the check of both follow from it. Text labels are marked :class:`Labels`, dataclasses
within a dataclass :class:`Part`; a field without a mark is not stored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from operator import attrgetter
from typing import Annotated, Any, Final, Literal, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts.groups import ROOT, Array, Group
from swesbi.base.arrays import BoolArray
from swesbi.parameters import THETA_NAMES

Stored = TypeVar("Stored")

NUMERIC: Final = "biuf"
TEXT: Final = "OSUT"
PARAMETER: Final = "parameter"


@dataclass(frozen=True)
class Variable:
    """One dataset of an artefact; spaces separate the dimensions that it lies ``along``.

    A dataset that is named as its only dimension is its labels. Units are in UDUNITS notation, or words;
    ``{name}`` in a meaning stands for what a :class:`Part` says. ``name`` is given where it is not the
    field's, ``group`` where it is not that of the other datasets. ``after`` names the dataset that it
    follows, where it does not lie in the order of the fields. ``text`` follows from the type of a field.
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
    """Text labels of a dimension, which readers need; ``name`` is given where it is not the dimension's.

    They lie in ``group`` alone; without one, in all groups that have the dimension.
    """

    along: str
    name: str = ""
    group: str = ""


@dataclass(frozen=True)
class Part:
    """A dataclass within another, whose datasets lie beside the others.

    ``name`` is the pattern of their names (``{}``: that within the part), ``along`` the dimensions before
    theirs. Given units replace theirs, the group is that of those which name none, and ``words`` stand for
    the names in braces in their meanings.
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

    Values that the schema lacks are left out. Labels lie along the dimension of their name, or are
    given with theirs before them; those along other dimensions than the group's are left out.
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
    """Compare one group, which may hold other datasets too, with what is said of it.

    The ``required`` text labels are those that it needs if it has their dimension.
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


def schema_of(stored: type, along: str = "") -> dict[str, dict[str, Variable]]:
    """Return the groups and datasets that a dataclass, or several along a dimension, are stored as."""
    found: dict[str, dict[str, Variable]] = {ROOT: {}}
    for _, mark in _leaves(stored).values():
        if isinstance(mark, Variable):
            variable = Part(along=along).place(mark)
            found.setdefault(variable.group or ROOT, {})[variable.name] = variable
    return {group: arranged(variables) for group, variables in found.items() if variables}


def labels_of(stored: type) -> tuple[Labels, ...]:
    """Return the text labels that a dataclass has."""
    return tuple(mark for _, mark in _leaves(stored).values() if isinstance(mark, Labels))


def values_of(whole: object) -> dict[str, dict[str, NDArray[Any]]]:
    """Return group -> dataset name -> value of a dataclass, truth values as integers."""
    stored: type = type(whole)
    found: dict[str, dict[str, NDArray[Any]]] = {}
    for path, (_, mark) in _leaves(stored).items():
        if isinstance(mark, Variable):
            array = np.asarray(attrgetter(path)(whole))
            value = array.astype(np.int8) if array.dtype == np.bool_ else array
            found.setdefault(mark.group or ROOT, {})[mark.name] = value
    return found


def stacked_values(parts: Sequence[object]) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the values of several dataclasses, at least one, which become the first axis."""
    columns = [values_of(part) for part in parts]
    return {
        group: {name: np.stack([column[group][name] for column in columns]) for name in names}
        for group, names in columns[0].items()
    }


def to_groups(whole: object, labels: Mapping[str, Any] | None = None) -> dict[str, Group]:
    """Return a dataclass as the groups of its artefact, with labels by dimension for groups that have it."""
    stored: type = type(whole)
    values = values_of(whole)
    texts = [
        (mark, list(attrgetter(path)(whole)))
        for path, (_, mark) in _leaves(stored).items()
        if isinstance(mark, Labels)
    ]
    groups: dict[str, Group] = {}
    for group, variables in schema_of(stored).items():
        own = {mark.name: (mark.along, names) for mark, names in texts if mark.group in ("", group)}
        groups[group] = build_group(variables, values[group], {**(labels or {}), **own})
    return groups


def from_groups(
    stored: type[Stored], groups: Mapping[str, Group], given: Mapping[str, Any] | None = None
) -> Stored:
    """Rebuild a dataclass from the groups of its artefact.

    ``given`` are the values of fields that are not read, those of a part by ``part.name``.
    """
    leaves, known = _leaves(cast("type", stored)), given or {}

    def rebuilt(part: Any, above: str) -> Any:  # noqa: ANN401
        """Rebuild the whole, or a part with the way to it, from what is given or else stored by path."""
        values = {}
        for name in (member.name for member in fields(part)):
            path = f"{above}{name}"
            if path in known:
                values[name] = known[path]
            elif path in leaves:
                values[name] = _read(*leaves[path], groups)
            elif name in _marked(part):
                values[name] = rebuilt(_marked(part)[name][0], f"{path}.")
        return part(**values)

    return cast("Stored", rebuilt(stored, ""))


def from_rows(stored: type[Stored], dataset: Group, along: str, **given: Sequence[Any]) -> list[Stored]:
    """Rebuild the dataclasses that lie along a dimension of the root; of fields given, one value a row."""
    wanted = {mark.name for _, mark in _leaves(cast("type", stored)).values()}
    own = replace(dataset, arrays={name: one for name, one in dataset.arrays.items() if name in wanted})
    return [
        from_groups(
            stored,
            {ROOT: own.at(along, index)},
            {name: values[index] for name, values in given.items()},
        )
        for index in range(dataset.sizes[along])
    ]


@cache
def _leaves(stored: type) -> dict[str, tuple[Any, Variable | Labels]]:
    """Return type and mark of what is stored, by the way to it: fields in order, then properties."""
    leaves: dict[str, tuple[Any, Variable | Labels]] = {}
    for name, (hint, mark) in _marked(stored).items():
        if isinstance(mark, Part):
            below = _leaves(hint).items()
            leaves |= {f"{name}.{path}": (inner, _placed(own, mark)) for path, (inner, own) in below}
        elif isinstance(mark, Labels):
            leaves[name] = hint, replace(mark, name=mark.name or mark.along)
        else:
            leaves[name] = hint, replace(mark, name=mark.name or name, text=mark.text or _is_text(hint))
    return leaves


def _placed(mark: Variable | Labels, part: Part) -> Variable | Labels:
    if isinstance(mark, Variable):
        return part.place(mark)
    return replace(mark, group=mark.group or part.group)


@cache
def _marked(stored: type) -> dict[str, tuple[Any, Variable | Labels | Part]]:
    """Return type and mark of the marked fields and properties of a dataclass, by their names."""
    hints = get_type_hints(stored, include_extras=True)
    hinted = {member.name: hints[member.name] for member in fields(cast("Any", stored))}
    for name, member in vars(stored).items():
        if isinstance(member, property):
            hinted[name] = get_type_hints(member.fget, include_extras=True).get("return")
    return {name: get_args(hint)[:2] for name, hint in hinted.items() if get_origin(hint) is Annotated}


def _is_text(hint: Any) -> bool:  # noqa: ANN401
    of_text = get_origin(hint) is Literal and isinstance(get_args(hint)[0], str)
    return of_text or hint is str or hint == NDArray[np.str_]


def _read(hint: Any, mark: Variable | Labels, groups: Mapping[str, Group]) -> Any:  # noqa: ANN401
    """Return the values of a field as its type says."""
    group = mark.group or ROOT
    if isinstance(mark, Labels) and mark.group not in groups:
        # they lie in every group that has their dimension
        group = next(key for key, arrays in groups.items() if mark.name in arrays)
    values = groups[group][mark.name].values
    if hint == BoolArray:
        return values.astype(np.bool_)
    if get_origin(hint) is tuple:
        return tuple(map(str, values))
    if hint is bool:
        return bool(values.item())
    return values.item() if get_origin(hint) is Literal or hint in (int, float, str) else values
