"""An HDF5 file holds its own data and no more of it than it has bytes: nothing else is read through it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import h5py

DEEPEST: Final = 2
UNUSED: Final = b"This is a netCDF dimension but not a netCDF variable"


def check_self_contained(path: Path) -> None:
    """Look at the structure of an HDF5 file before any of its arrays is read.

    Raises:
        ValueError: It leads to other files, names a thing twice, nests deeper than an artefact does or
            claims more data than it has bytes.
        OSError: It is no HDF5 file.
    """
    with h5py.File(path, "r") as file:
        _check_group(file, path.stat().st_size, depth=0)


def _check_group(group: h5py.Group, size: int, depth: int) -> None:
    if depth > DEEPEST:
        raise ValueError(f"the group {group.name} is nested too deeply")
    for name in group:
        where = f"{group.name.rstrip('/')}/{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"{where} is a link to elsewhere")
        item = group[name]
        if isinstance(item, h5py.Group):
            _check_group(item, size, depth + 1)
        elif isinstance(item, h5py.Dataset):
            _check_dataset(where, item, size)
        else:
            raise ValueError(f"{where} is neither a group nor a dataset")


def _check_dataset(where: str, dataset: h5py.Dataset, size: int) -> None:
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"{where} takes its data from another file")
    # a dimension without labels is an empty dataset, of which only the length is used
    unused = dataset.is_scale and bytes(dataset.attrs.get("NAME", b"")).startswith(UNUSED)
    if dataset.nbytes > size and not unused:
        raise ValueError(f"{where} claims {dataset.nbytes} bytes of data in a file of {size}")
