"""One group of an artefact in memory, and its way to netCDF-4: arrays with dimensions, units and meanings.

Jobs start often, and xarray takes longer to import than many of them take to run, so nothing here asks for
it. Files are as xarray would write and read them.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import h5netcdf
import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

ROOT: Final = "/"
UNUSED: Final = b"This is a netCDF dimension but not a netCDF variable"
NO_COORDINATE: Final = "_nc4_non_coord_"
"""Begins the name of a variable that is named as a dimension is, but has others."""
COORDINATES: Final = "coordinates"
"""Attribute of netCDF: labels of an array that are not named as its dimensions are."""
OF_HDF5: Final = frozenset(
    ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates")
    + ("_nc3_strict", "_NCProperties", "_FillValue", COORDINATES)
)
"""Attributes by which netCDF keeps its dimensions in HDF5, and how values are kept."""


@dataclass(frozen=True)
class Array:
    """Values along named dimensions, with attributes: units, meaning."""

    dims: tuple[str, ...]
    values: NDArray[Any]
    attrs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def sizes(self) -> dict[str, int]:
        """The length of each dimension."""
        return dict(zip(self.dims, self.values.shape, strict=True))

    def __array__(self, dtype: DTypeLike | None = None, *, copy: bool | None = None) -> NDArray[Any]:
        """Let NumPy take it for its values."""
        return np.array(self.values, dtype, copy=copy)

    def to_numpy(self) -> NDArray[Any]:
        """Return the values."""
        return self.values

    def item(self) -> Any:  # noqa: ANN401
        """Return the only value."""
        return self.values.item()


@dataclass(frozen=True)
class Group(Mapping[str, Array]):
    """Arrays by name; ``labels`` are the names of those that label a dimension."""

    arrays: Mapping[str, Array]
    labels: frozenset[str] = frozenset()
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.arrays)

    def __len__(self) -> int:
        return len(self.arrays)

    @property
    def sizes(self) -> dict[str, int]:
        """The length of each dimension, in the order of the arrays."""
        return {name: size for one in self.arrays.values() for name, size in one.sizes.items()}

    def at(self, along: str, index: int) -> Group:
        """Return the group at one place of a dimension."""
        found = dict(self.arrays)
        for name, one in self.arrays.items():
            if along in one.dims:
                dims = tuple(dim for dim in one.dims if dim != along)
                values = np.take(one.values, index, axis=one.dims.index(along))
                found[name] = Array(dims, np.asarray(values), one.attrs)
        return replace(self, arrays=found)

    def joined(self, other: Group) -> Group:
        """Return the arrays of two groups together; those of the other replace those of the same name."""
        return Group(
            {**self.arrays, **other.arrays}, self.labels | other.labels, {**self.attrs, **other.attrs}
        )


def as_netcdf(groups: Mapping[str, Group]) -> memoryview:
    """Return groups as the bytes of a netCDF-4 file; the group "/" is the root.

    It is composed in memory: the HDF5 library crashes the process when a disk fills up under it.
    """
    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        for name in sorted(groups, key=lambda one: one != ROOT):
            target = file if name == ROOT else file.create_group(name)
            target.attrs.update(groups[name].attrs)
            # a group has the dimensions of the root, as netCDF does
            inherited = {} if name == ROOT else groups[ROOT].sizes
            sizes = groups[name].sizes.items()
            target.dimensions = {dim: size for dim, size in sizes if inherited.get(dim) != size}
            for own, array in groups[name].items():
                _write(target, own, array, groups[name])
    return buffer.getbuffer()


def _write(target: h5netcdf.Group, name: str, array: Array, group: Group) -> None:
    texts = array.values.dtype.kind in "OSU"
    variable = target.create_variable(
        name,
        array.dims,
        h5py.string_dtype() if texts else array.values.dtype,
        data=array.values.astype(object) if texts else array.values,
        fillvalue=np.nan if array.values.dtype.kind == "f" and name not in array.dims else None,
    )
    variable.attrs.update(array.attrs)
    beside = sorted(
        label
        for label in group.labels - {name}
        if group[label].dims != (label,) and set(group[label].dims) <= set(array.dims)
    )
    if beside and name not in group.labels:
        variable.attrs[COORDINATES] = " ".join(beside)


def group_of(found: h5py.Group) -> Group:
    """Return an open group of a netCDF-4 file; raise one of ``files.UNREADABLE`` where it is none."""
    items = {
        name.removeprefix(NO_COORDINATE): item
        for name, item in found.items()
        if isinstance(item, h5py.Dataset) and not is_dimension_alone(item)
    }
    arrays = {name: _array(name, item) for name, item in items.items()}
    beside = {label for item in items.values() for label in str(item.attrs.get(COORDINATES, "")).split()}
    labels = beside | {name for name, array in arrays.items() if array.dims == (name,)}
    return Group(arrays, frozenset(labels & arrays.keys()), attributes_of(found))


def _array(name: str, item: h5py.Dataset) -> Array:
    dims: tuple[str, ...] = (name,) if "CLASS" in item.attrs else ()
    if "DIMENSION_LIST" in item.attrs:
        scales = (h5py.h5r.get_name(axis[0], item.id) for axis in item.attrs["DIMENSION_LIST"])
        dims = tuple((scale or b"").decode().rpartition("/")[2] for scale in scales)
    texts = h5py.check_string_dtype(item.dtype) is not None
    values = np.asarray(item.asstr()[()]).astype(str) if texts else np.asarray(item[()])
    return Array(dims, values, attributes_of(item))


def attributes_of(item: h5py.HLObject) -> dict[str, Any]:
    """Return the attributes that are none of HDF5's own; arrays of one number as this number."""
    values = {name: item.attrs[name] for name in item.attrs if name not in OF_HDF5}
    return {name: value[0] if np.shape(value) == (1,) else value for name, value in values.items()}


def is_dimension_alone(item: h5py.Dataset) -> bool:
    """Tell whether a dataset only says how long a dimension is."""
    return item.is_scale and bytes(item.attrs.get("NAME", b"")).startswith(UNUSED)
