"""Dataclasses as the datasets of an artefact, and back: all follows from the marks on their fields."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import repeat
from operator import attrgetter
from typing import Annotated, Any, Literal, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts.groups import ROOT, Array, Group
from swesbi.artefacts.schema import Labels, Part, Variable, arranged, build_group
from swesbi.base.arrays import BoolArray

Stored = TypeVar("Stored")
Arrays = Mapping[Any, NDArray[Any]]
"""Values by dataset name."""


@dataclass(frozen=True)
class _Leaf:
    """A marked field or property: the way to it from the whole, its type, and what is said of it."""

    path: str
    hint: Any
    mark: Variable | Labels


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


def to_groups(whole: object, labels: Mapping[str, Any] | None = None) -> dict[str, Group]:
    """Return a dataclass as the groups of its artefact.

    Args:
        whole: The dataclass.
        labels: Labels along the dimensions of their names, of the groups that have these.
    """
    stored: type = type(whole)
    schema, values = schema_of(stored), values_of(whole)
    own: dict[str, dict[str, Any]] = {group: {} for group in schema}
    for leaf in _leaves(stored):
        if isinstance(leaf.mark, Labels):
            texts = (leaf.mark.along, list(attrgetter(leaf.path)(whole)))
            for group in [leaf.mark.group] if leaf.mark.group else schema:
                own[group][leaf.mark.name or leaf.mark.along] = texts
    return {
        group: build_group(schema[group], values[group], {**(labels or {}), **own[group]}) for group in schema
    }


def to_group(whole: object, labels: Mapping[str, Any] | None = None) -> Group:
    """Return a dataclass as its only group; arguments as of :func:`to_groups`."""
    (dataset,) = to_groups(whole, labels).values()
    return dataset


def from_groups(
    stored: type[Stored], groups: Mapping[str, Group], given: Mapping[str, Any] | None = None
) -> Stored:
    """Rebuild a dataclass from the groups of its artefact.

    Args:
        stored: The dataclass.
        groups: Group name -> dataset.
        given: Values of fields that are not read; of a part's as ``part.name``.
    """
    arrays = {name: {key: array.values for key, array in group.items()} for name, group in groups.items()}
    return _rebuilt(stored, arrays, given or {}, "", Part())


def from_group(stored: type[Stored], dataset: Group, **given: object) -> Stored:
    """Rebuild a dataclass from its only group, some fields given."""
    return from_groups(stored, {group: dataset for group in schema_of(stored)}, given)


def from_rows(stored: type[Stored], dataset: Group, along: str, **given: Sequence[Any]) -> list[Stored]:
    """Rebuild the dataclasses that lie along a dimension; the fields that are given, one value a row."""
    columns = {name: _rows_of(values, along) for name, values in dataset.items()}
    rows = ({name: next(column) for name, column in columns.items()} for _ in range(dataset.sizes[along]))
    groups = list(schema_of(stored))
    return [
        _rebuilt(
            stored,
            dict.fromkeys(groups, row),
            {name: values[index] for name, values in given.items()},
            "",
            Part(),
        )
        for index, row in enumerate(rows)
    ]


def _rows_of(array: Array, along: str) -> Iterator[NDArray[Any]]:
    """Return the values at each place of a dimension; of an array that has it not, the same every time."""
    values = array.values
    return iter(np.moveaxis(values, array.dims.index(along), 0)) if along in array.dims else repeat(values)


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
            placed = (
                mark.place(leaf.mark)
                if isinstance(leaf.mark, Variable)
                else replace(leaf.mark, group=leaf.mark.group or mark.group)
            )
            yield _Leaf(f"{name}.{leaf.path}", leaf.hint, placed)


@cache
def _marked(stored: type) -> tuple[tuple[str, Any, Variable | Labels | Part], ...]:
    """Return name, type and mark of the marked fields and properties of a dataclass."""
    hints = get_type_hints(stored, include_extras=True)
    hinted = {member.name: hints[member.name] for member in fields(cast("Any", stored))}
    for name, member in vars(stored).items():
        if isinstance(member, property):
            hinted[name] = get_type_hints(member.fget, include_extras=True).get("return")
    return tuple(
        (name, get_args(hint)[0], get_args(hint)[1])
        for name, hint in hinted.items()
        if get_origin(hint) is Annotated
    )


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
    stored: type[Stored], groups: Mapping[str, Arrays], given: Mapping[str, Any], path: str, part: Part
) -> Stored:
    """Rebuild a dataclass whose variables are placed as a part, and whose fields are given by their path."""
    marks = {name: (hint, mark) for name, hint, mark in _marked(cast("type", stored))}
    values = {}
    for name in (member.name for member in fields(cast("Any", stored))):
        if (at := f"{path}{name}") in given:
            values[name] = given[at]
        elif name in marks:
            values[name] = _found(name, *marks[name], groups, given, at, part)
    return stored(**values)


def _found(
    name: str,
    hint: Any,  # noqa: ANN401
    mark: Variable | Labels | Part,
    groups: Mapping[str, Arrays],
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
        labels, own = mark.name or mark.along, groups.get(part.group)
        among = [own] if own is not None else groups.values()
        return _read(next(group[labels] for group in among if labels in group), hint)
    placed = part.place(replace(mark, name=mark.name or name, meaning=""))
    return _read(groups[placed.group or ROOT][placed.name], hint)


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
