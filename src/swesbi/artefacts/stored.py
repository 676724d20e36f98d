"""Dataclasses as the datasets of an artefact, and back: all follows from the marks on their fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from operator import attrgetter
from typing import Annotated, Any, Literal, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts.groups import ROOT, Group
from swesbi.artefacts.schema import Labels, Part, Variable, arranged, build_group
from swesbi.base.arrays import BoolArray

Stored = TypeVar("Stored")


@dataclass(frozen=True)
class _Leaf:
    """A marked field or property of a dataclass or of its parts: its type, and what is said of it."""

    hint: Any
    mark: Variable | Labels


def schema_of(stored: type, along: str = "") -> dict[str, dict[str, Variable]]:
    """Return the groups and datasets that a dataclass is stored as.

    Args:
        stored: The dataclass.
        along: The dimension of several of them, if any.
    """
    found: dict[str, dict[str, Variable]] = {ROOT: {}}
    for leaf in _leaves(stored).values():
        if isinstance(leaf.mark, Variable):
            variable = Part(along=along).place(leaf.mark)
            found.setdefault(variable.group or ROOT, {})[variable.name] = variable
    return {group: arranged(variables) for group, variables in found.items() if variables}


def labels_of(stored: type) -> tuple[Labels, ...]:
    """Return the text labels that a dataclass has."""
    return tuple(leaf.mark for leaf in _leaves(stored).values() if isinstance(leaf.mark, Labels))


def values_of(whole: object) -> dict[str, dict[str, NDArray[Any]]]:
    """Return group -> dataset name -> value of a dataclass, truth values as integers."""
    stored: type = type(whole)
    found: dict[str, dict[str, NDArray[Any]]] = {}
    for path, leaf in _leaves(stored).items():
        if isinstance(leaf.mark, Variable):
            array = np.asarray(attrgetter(path)(whole))
            value = array.astype(np.int8) if array.dtype == np.bool_ else array
            found.setdefault(leaf.mark.group or ROOT, {})[leaf.mark.name] = value
    return found


def stacked_values(parts: Sequence[object]) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the values of several dataclasses, at least one, which become the first axis."""
    columns = [values_of(part) for part in parts]
    return {
        group: {name: np.stack([column[group][name] for column in columns]) for name in names}
        for group, names in columns[0].items()
    }


def to_groups(whole: object, labels: Mapping[str, Any] | None = None) -> dict[str, Group]:
    """Return a dataclass as the groups of its artefact.

    Args:
        whole: The dataclass.
        labels: Labels along the dimensions of their names, of the groups that have these.
    """
    stored: type = type(whole)
    values = values_of(whole)
    texts = [
        (leaf.mark, list(attrgetter(path)(whole)))
        for path, leaf in _leaves(stored).items()
        if isinstance(leaf.mark, Labels)
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

    Args:
        stored: The dataclass.
        groups: Group name -> dataset.
        given: Values of fields that are not read; of a part's as ``part.name``.
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
                values[name] = _read(leaves[path], groups)
            elif name in _marked(part):
                values[name] = rebuilt(_marked(part)[name][0], f"{path}.")
        return part(**values)

    return cast("Stored", rebuilt(stored, ""))


def from_rows(stored: type[Stored], dataset: Group, along: str, **given: Sequence[Any]) -> list[Stored]:
    """Rebuild the dataclasses that lie along a dimension of the root; of fields given, one value a row."""
    return [
        from_groups(
            stored,
            {ROOT: dataset.at(along, index)},
            {name: values[index] for name, values in given.items()},
        )
        for index in range(dataset.sizes[along])
    ]


@cache
def _leaves(stored: type) -> dict[str, _Leaf]:
    """Return what is stored, by the way to it from the whole: fields in order, then properties."""
    leaves: dict[str, _Leaf] = {}
    for name, (hint, mark) in _marked(stored).items():
        if isinstance(mark, Labels):
            leaves[name] = _Leaf(hint, replace(mark, name=mark.name or mark.along))
        elif isinstance(mark, Variable):
            text = mark.text or _is_text(hint)
            leaves[name] = _Leaf(hint, replace(mark, name=mark.name or name, text=text))
        else:
            leaves |= {f"{name}.{path}": _placed(leaf, mark) for path, leaf in _leaves(hint).items()}
    return leaves


def _placed(leaf: _Leaf, part: Part) -> _Leaf:
    mark = leaf.mark
    if isinstance(mark, Variable):
        return replace(leaf, mark=part.place(mark))
    return replace(leaf, mark=replace(mark, group=mark.group or part.group))


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


def _read(leaf: _Leaf, groups: Mapping[str, Group]) -> Any:  # noqa: ANN401
    """Return the values of a field as its type says."""
    hint, name, group = leaf.hint, leaf.mark.name, leaf.mark.group or ROOT
    if isinstance(leaf.mark, Labels) and leaf.mark.group not in groups:
        # they lie in every group that has their dimension
        group = next(key for key, arrays in groups.items() if name in arrays)
    values = groups[group][name].values
    if hint == BoolArray:
        return values.astype(np.bool_)
    if get_origin(hint) is tuple:
        return tuple(map(str, values))
    if hint is bool:
        return bool(values.item())
    return values.item() if get_origin(hint) is Literal or hint in (int, float, str) else values
