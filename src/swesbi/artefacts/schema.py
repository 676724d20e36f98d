"""What an artefact holds, said once: dimensions, units and meaning on the fields of its dataclasses.

A new dataset of an artefact is one line in one dataclass, a field or, where it is computed, a property::

    wall_stress_kpa: Annotated[FloatArray, Variable("simulation cycle", "kPa", "circumferential wall stress")]

Writing, reading, and the check of both follow from it. Text labels are marked :class:`Labels`, dataclasses
within a dataclass :class:`Part`; a field without a mark is not stored. A package makes its kind of artefact
known by :func:`register`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from operator import attrgetter
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    TypeVar,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import NDArray

from swesbi.arrays import BoolArray
from swesbi.parameters import THETA_NAMES

if TYPE_CHECKING:
    import xarray as xr

ROOT: Final = "/"
NUMERIC: Final = "biuf"
TEXT: Final = "OSUT"
PARAMETER: Final = "parameter"
Stored = TypeVar("Stored")


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
    """Text labels of a dimension, which readers need; ``name`` is the dimension's unless it is given."""

    along: str
    name: str = ""


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


@dataclass(frozen=True)
class _Leaf:
    """A marked field or property: the way to it from the whole, its type, and what is said of it."""

    path: str
    hint: Any
    mark: Variable | Labels


Schema = Mapping[str, Mapping[str, Variable]]
"""Of one kind of artefact: group name -> dataset name -> variable; the group "/" is the root."""

SCHEMAS: Final[dict[str, Schema]] = {}
LABELS: Final[dict[str, tuple[Labels, ...]]] = {}


def register(kind: str, schema: Schema, labels: Iterable[str | Labels] = ()) -> str:
    """Make a kind of artefact known to :func:`check_groups` and return it.

    Args:
        kind: Its name.
        schema: What it holds.
        labels: Text labels that every group has which has the dimension.
    """
    SCHEMAS[kind] = schema
    LABELS[kind] = tuple(Labels(one) if isinstance(one, str) else one for one in labels)
    return kind


def schema_of(stored: type, along: str = "") -> dict[str, dict[str, Variable]]:
    """Return the groups and datasets that a dataclass is stored as.

    Args:
        stored: The dataclass.
        along: The dimension of several of them, if any.
    """
    found: dict[str, dict[str, Variable]] = {ROOT: {}}
    for leaf in _leaves(stored):
        if isinstance(leaf.mark, Variable):
            variable = Part(along=along).place(leaf.mark)
            found.setdefault(variable.group or ROOT, {})[variable.name] = variable
    return {group: arranged(variables) for group, variables in found.items() if variables}


def arranged(variables: Mapping[str, Variable]) -> dict[str, Variable]:
    """Return variables in order, those that say so right behind another."""
    names = list(variables)
    for name, variable in variables.items():
        if variable.after:
            names.remove(name)
            names.insert(names.index(variable.after) + 1, name)
    return {name: variables[name] for name in names}


def labels_of(stored: type) -> tuple[Labels, ...]:
    """Return the text labels that a dataclass has."""
    return tuple(leaf.mark for leaf in _leaves(stored) if isinstance(leaf.mark, Labels))


def values_of(whole: object) -> dict[str, dict[str, Any]]:
    """Return group -> dataset name -> value of a dataclass, truth values as integers."""
    stored: type = type(whole)
    found: dict[str, dict[str, Any]] = {}
    for leaf in _leaves(stored):
        if isinstance(leaf.mark, Variable):
            value = _stored(attrgetter(leaf.path)(whole))
            found.setdefault(leaf.mark.group or ROOT, {})[leaf.mark.name] = value
    return found


def stacked_values(parts: Sequence[object]) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the values of several dataclasses, at least one, which become the first axis."""
    columns = [values_of(part) for part in parts]
    return {
        group: {name: np.stack([np.asarray(column[group][name]) for column in columns]) for name in names}
        for group, names in columns[0].items()
    }


def to_groups(whole: object, labels: Mapping[str, Any] | None = None) -> dict[str, xr.Dataset]:
    """Return a dataclass as the groups of its artefact.

    Args:
        whole: The dataclass.
        labels: Label coordinates, as xarray takes them, of the groups that have their dimension.
    """
    stored: type = type(whole)
    own = {
        leaf.mark.name or leaf.mark.along: (leaf.mark.along, list(attrgetter(leaf.path)(whole)))
        for leaf in _leaves(stored)
        if isinstance(leaf.mark, Labels)
    }
    schema, values = schema_of(stored), values_of(whole)
    return {group: build_dataset(schema[group], values[group], {**(labels or {}), **own}) for group in schema}


def to_dataset(whole: object, labels: Mapping[str, Any] | None = None) -> xr.Dataset:
    """Return a dataclass as its only group; arguments as of :func:`to_groups`."""
    (dataset,) = to_groups(whole, labels).values()
    return dataset


def from_groups(
    stored: type[Stored], groups: Mapping[str, xr.Dataset], given: Mapping[str, Any] | None = None
) -> Stored:
    """Rebuild a dataclass from the groups of its artefact.

    Args:
        stored: The dataclass.
        groups: Group name -> dataset.
        given: Values of fields that are not read; of a part's as ``part.name``.
    """
    return _rebuilt(stored, groups, given or {}, "", Part())


def from_dataset(stored: type[Stored], dataset: xr.Dataset, **given: object) -> Stored:
    """Rebuild a dataclass from its only group, some fields given."""
    return from_groups(stored, {group: dataset for group in schema_of(stored)}, given)


def from_rows(stored: type[Stored], dataset: xr.Dataset, along: str, **given: Sequence[Any]) -> list[Stored]:
    """Rebuild the dataclasses that lie along a dimension; the fields that are given, one value a row."""
    rows = (dataset.isel({along: index}) for index in range(dataset.sizes[along]))
    return [
        from_dataset(stored, row, **{name: values[index] for name, values in given.items()})
        for index, row in enumerate(rows)
    ]


def build_dataset(
    schema: Mapping[str, Variable], values: Mapping[str, Any], labels: Mapping[str, Any] | None = None
) -> xr.Dataset:
    """Return a dataset with the dimensions, units and meanings of one group's schema, and its labels.

    Args:
        schema: Dataset name -> variable, of one group.
        values: Dataset name -> array; names that the schema lacks are left out.
        labels: Label coordinates, as xarray takes them; those along other dimensions are left out.

    Raises:
        KeyError: A dataset of the schema has no values.
    """
    import xarray as xr  # half a second, which whoever only names an artefact need not wait

    variables = {
        name: (variable.dims, values[name], {"units": variable.units, "long_name": variable.meaning})
        for name, variable in schema.items()
    }
    dataset = xr.Dataset(variables)
    return dataset.assign_coords(
        {
            name: label
            for name, label in (labels or {}).items()
            if (label[0] if isinstance(label, tuple) else name) in dataset.dims
        }
    )


def check_groups(kind: str, groups: Mapping[str, xr.Dataset]) -> None:
    """Compare an artefact's content with the schema of its kind.

    Raises:
        ValueError: The kind is unknown, a group is missing, or one differs from its schema.
    """
    for group in _known(kind):
        if group not in groups:
            raise ValueError(f"a {kind!r} artefact needs the group {group!r}")
        check_group(kind, group, groups[group])


def check_group(kind: str, group: str, dataset: xr.Dataset) -> None:
    """Compare one group with the schema of its kind; a group that the schema does not name is free.

    Raises:
        ValueError: The kind is unknown, or a variable or a label is missing, or has other units,
            dimensions or another type.
    """
    variables = _known(kind).get(group, {})
    if missing := set(variables) - set(dataset.variables):
        raise ValueError(f"group {group!r} lacks {sorted(missing)}")
    for name, expected in variables.items():
        _check_variable(f"{group.rstrip('/')}/{name}", dataset[name], expected)
    dimensions = {dimension for variable in variables.values() for dimension in variable.dims}
    for labels in LABELS.get(kind, ()):
        name = labels.name or labels.along
        has_labels = name in dataset.coords and dataset[name].dtype.kind in TEXT
        if labels.along in dimensions and not has_labels:
            raise ValueError(f"group {group!r} lacks the labels {name!r}")
    _check_parameters(group, dataset)


def _known(kind: str) -> Schema:
    if kind not in SCHEMAS:
        raise ValueError(f"unknown artefact kind {kind!r}; known: {', '.join(SCHEMAS)}")
    return SCHEMAS[kind]


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


@cache
def _leaves(stored: type) -> tuple[_Leaf, ...]:
    """Return what is stored of a dataclass and of its parts: fields in order, then properties."""
    return tuple(leaf for name, hint, mark in _marked(stored) for leaf in _under(name, hint, mark))


def _under(name: str, hint: Any, mark: Variable | Labels | Part) -> Iterator[_Leaf]:  # noqa: ANN401
    if isinstance(mark, Labels):
        yield _Leaf(name, hint, mark)
    elif isinstance(mark, Variable):
        yield _Leaf(name, hint, replace(mark, name=mark.name or name, text=mark.text or _is_text(hint)))
    else:
        for leaf in _leaves(hint):
            placed = mark.place(leaf.mark) if isinstance(leaf.mark, Variable) else leaf.mark
            yield _Leaf(f"{name}.{leaf.path}", leaf.hint, placed)


def _marked(stored: type) -> Iterator[tuple[str, Any, Variable | Labels | Part]]:
    """Yield name, type and mark of the marked fields and properties of a dataclass."""
    hints = get_type_hints(stored, include_extras=True)
    found = {one.name: hints[one.name] for one in fields(cast("Any", stored))}
    for name, member in vars(stored).items():
        if isinstance(member, property):
            found[name] = get_type_hints(member.fget, include_extras=True).get("return")
    for name, hint in found.items():
        if get_origin(hint) is Annotated:
            yield name, get_args(hint)[0], get_args(hint)[1]


def _is_text(hint: Any) -> bool:  # noqa: ANN401
    of_text = get_origin(hint) is Literal and isinstance(get_args(hint)[0], str)
    return of_text or hint is str or hint == NDArray[np.str_]


def _stored(value: Any) -> Any:  # noqa: ANN401
    """Return a value as HDF5 holds it: truth values as integers."""
    if isinstance(value, tuple):
        return list(value)
    is_truth = isinstance(value, bool) or (isinstance(value, np.ndarray) and value.dtype == np.bool_)
    return np.asarray(value).astype(np.int8)[()] if is_truth else value


def _rebuilt(
    stored: type[Stored], groups: Mapping[str, xr.Dataset], given: Mapping[str, Any], path: str, part: Part
) -> Stored:
    """Rebuild a dataclass whose variables are placed as a part, and whose fields are given by their path."""
    marks = {name: (hint, mark) for name, hint, mark in _marked(stored)}
    values = {}
    for name in (one.name for one in fields(cast("Any", stored))):
        if (at := f"{path}{name}") in given:
            values[name] = given[at]
        elif name in marks:
            values[name] = _found(name, *marks[name], groups, given, at, part)
    return stored(**values)


def _found(
    name: str,
    hint: Any,  # noqa: ANN401
    mark: Variable | Labels | Part,
    groups: Mapping[str, xr.Dataset],
    given: Mapping[str, Any],
    at: str,
    part: Part,
) -> Any:  # noqa: ANN401
    if isinstance(mark, Part):
        within = replace(
            mark, name=part.name.format(mark.name), group=mark.group or part.group, words=part.words
        )
        return _rebuilt(hint, groups, given, f"{at}.", within)
    if isinstance(mark, Labels):
        dataset = next(one for one in groups.values() if (mark.name or mark.along) in one.coords)
        return _read(dataset[mark.name or mark.along].to_numpy(), hint)
    placed = part.place(replace(mark, name=mark.name or name, meaning=""))
    return _read(groups[placed.group or ROOT][placed.name].to_numpy(), hint)


def _read(values: NDArray[Any], hint: Any) -> Any:  # noqa: ANN401
    """Return values as the type of their field says."""
    if hint == BoolArray:
        return values.astype(np.bool_)
    if hint == NDArray[np.str_]:
        return values.astype(str)
    if get_origin(hint) is tuple:
        return tuple(map(str, values))
    if hint is bool:
        return bool(values.item())
    if _is_text(hint):
        return str(values.item())
    return values.item() if hint in (int, float) else values
