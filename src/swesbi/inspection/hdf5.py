"""HDF5 artefacts."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from swesbi.artefacts import DamagedArtefactError
from swesbi.artefacts.files import UNREADABLE, check_self_contained, hdf5_provenance
from swesbi.inspection.artefact import described, integrity
from swesbi.inspection.content import Array, Content, as_text


def read_hdf5(path: Path) -> Content:
    """Return an HDF5 artefact of any kind and schema version.

    Raises:
        DamagedArtefactError: It was cut off or changed, or is no artefact.
    """
    checked = integrity(path, hdf5_provenance)
    try:
        check_self_contained(path)
        provenance = hdf5_provenance(path)
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            arrays = tuple(
                _array(node.path, str(name), variable)
                for node in tree.subtree
                for name, variable in node.to_dataset(inherit=False).variables.items()
            )
    except UNREADABLE as error:
        raise DamagedArtefactError(path, f"cannot be read as a swesbi artefact ({error})") from error
    return described(path, checked, provenance, arrays)


def _array(group: str, name: str, variable: xr.Variable) -> Array:
    values = variable.to_numpy()
    return Array(
        name=f"{group.strip('/')}/{name}".removeprefix("/"),
        dims=tuple(map(str, variable.dims)),
        values=values if values.dtype.kind in "biuf" else as_text(values),
        units=str(variable.attrs.get("units", "")),
        meaning=str(variable.attrs.get("long_name", "")),
    )
