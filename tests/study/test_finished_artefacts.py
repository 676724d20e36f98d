"""Every artefact of a finished study is worth opening: units, named dimensions, provenance."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest
import xarray as xr
from rules import PLACES
from study_copy import StudyCopy

from swesbi.artefacts import Artefact
from swesbi.artefacts.files import SCHEMA_VERSION, read_groups

for module, _ in PLACES.values():  # what they write is known where they are loaded
    import_module(module)


def classes_below(parent: type[Artefact]) -> Iterator[type[Artefact]]:
    for one in parent.__subclasses__():
        yield one
        yield from classes_below(one)


CLASSES: dict[str, type[Artefact]] = {}
for known in classes_below(Artefact):
    if hasattr(known, "kind"):
        CLASSES.setdefault(known.kind, known)  # the first of a kind is what every file of it follows


@pytest.fixture(scope="module")
def files(finished: StudyCopy) -> list[Path]:
    found = sorted(finished.results.rglob("*.h5"))
    names = {path.name.split("-")[0].removesuffix(".h5") for path in found}
    assert names >= {"observation", "passive", "shard", "pool", "posterior", "predictive"}
    return found


def test_groups_are_read_as_xarray_reads_them(files: list[Path]) -> None:
    """By less work: values, types, names, coordinates and attributes are those of ``open_dataset``."""
    for path in files:
        for group, read in read_groups(path).items():
            with xr.open_dataset(path, engine="h5netcdf", group=group) as expected:
                variables = {name: (one.dims, one.values, one.attrs) for name, one in read.items()}
                found = xr.Dataset(variables, attrs=read.attrs).set_coords([*read.labels])
                xr.testing.assert_identical(found, expected)
                for name, one in expected.variables.items():
                    assert found[name].dtype == one.dtype
                    assert one.attrs.get("units"), f"{path}: {group} {name}"


def test_every_artefact_opens_with_xarray_as_its_schema_says(files: list[Path]) -> None:
    """A dimension without a name would not open."""
    for path in files:
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            assert json.loads(tree.attrs["settings"])
            assert tree.attrs["code_hash"]
            assert tree.attrs["schema_version"] == SCHEMA_VERSION
            for group, variables in CLASSES[tree.attrs["kind"]].schema().items():
                for name, variable in variables.items():
                    found = tree[group].to_dataset()[name]
                    assert found.dims == variable.dims, f"{path}: {group} {name}"
                    assert found.attrs["units"] == variable.units
