"""Every artefact of a finished study is worth opening: units, named dimensions, provenance."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import arviz
import h5py
import pytest
import xarray as xr
from rules import PLACES
from study_copy import StudyCopy

from swesbi.artefacts import Artefact
from swesbi.artefacts.files import read_groups
from swesbi.artefacts.provenance import SCHEMA_VERSION
from swesbi.parameters import THETA_NAMES

for module, _ in PLACES.values():  # what they write is known where they are loaded
    import_module(module)

PHONY = "This is a netCDF dimension but not a netCDF variable"


def classes_below(parent: type[Artefact]) -> Iterator[type[Artefact]]:
    for one in parent.__subclasses__():
        yield one
        yield from classes_below(one)


CLASSES: dict[str, type[Artefact]] = {}
for known in classes_below(Artefact):
    if hasattr(known, "kind"):
        CLASSES.setdefault(known.kind, known)  # the first of a kind is what every file of it follows


def hdf5_files(study: StudyCopy) -> list[Path]:
    files = sorted(study.results.rglob("*.h5"))
    assert {path.name.split("-")[0].removesuffix(".h5") for path in files} >= {
        "observation",
        "passive",
        "shard",
        "pool",
        "posterior",
        "predictive",
    }
    return files


def test_every_dataset_has_units_and_named_dimensions(finished: StudyCopy) -> None:
    for path in hdf5_files(finished):
        with h5py.File(path) as file:
            assert file.attrs["kind"] in CLASSES
            assert json.loads(file.attrs["settings"])
            assert file.attrs["code_hash"]
            assert file.attrs["schema_version"] == SCHEMA_VERSION
            file.visititems(lambda name, item, path=path: check_item(path, name, item))


def check_item(path: Path, name: str, item: h5py.Group | h5py.Dataset) -> None:
    """Check one dataset; a dimension without labels is no dataset."""
    if not isinstance(item, h5py.Dataset) or item.attrs.get("NAME", b"").decode().startswith(PHONY):
        return
    assert item.attrs.get("units"), f"{path}: {name} has no units"
    if not item.is_scale:
        assert all(len(dim) for dim in item.dims), f"{path}: {name} has a dimension without a name"


def test_groups_are_read_as_xarray_reads_them(finished: StudyCopy) -> None:
    """By less work: values, types, names, coordinates and attributes are those of ``open_dataset``."""
    for path in hdf5_files(finished):
        for group, read in read_groups(path).items():
            with xr.open_dataset(path, engine="h5netcdf", group=group) as expected:
                found = read.to_xarray()
                xr.testing.assert_identical(found, expected)
                assert {name: one.dtype for name, one in found.variables.items()} == {
                    name: one.dtype for name, one in expected.variables.items()
                }


def test_every_artefact_opens_with_xarray_as_its_schema_says(finished: StudyCopy) -> None:
    for path in hdf5_files(finished):
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            for group, variables in CLASSES[tree.attrs["kind"]].schema().items():
                for name, variable in variables.items():
                    found = tree[group].to_dataset()[name]
                    assert found.dims == variable.dims, f"{path}: {group} {name}"
                    assert found.attrs["units"] == variable.units


@pytest.mark.parametrize("subject", ["A", "F"])
def test_the_posterior_opens_with_arviz(finished: StudyCopy, subject: str) -> None:
    path = finished.results / "paper" / "subjects" / subject / "posterior.h5"
    posterior = arviz.from_netcdf(str(path), engine="h5netcdf").posterior
    assert set(posterior.data_vars) == set(THETA_NAMES)
    assert posterior["k0_kpa"].dims == ("chain", "draw")
    assert posterior["k0_kpa"].attrs["units"] == "kPa"
