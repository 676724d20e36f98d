import hashlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from swesbi.artefacts import ArtefactError, Provenance, Variable, atomic_path, load, save, schema
from swesbi.parameters import THETA_NAMES

TOY = {"toy": {"/": {"speed_m_s": Variable("phase", "m s-1", "speed")}}}


@pytest.fixture(autouse=True)
def toy_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schema, "SCHEMAS", TOY)


def dataset(values: tuple[float, ...] = (1.0, np.nan, 3.0), units: str = "m s-1") -> xr.Dataset:
    return xr.Dataset({"speed_m_s": ("phase", np.array(values), {"units": units})})


def test_what_is_saved_is_read_back_with_its_provenance(tmp_path: Path) -> None:
    origin = Provenance("toy", "A", 7, {"b": 1.5, "a": [1, 2]}, "cafe")
    save(tmp_path / "new" / "toy.h5", dataset(), origin)
    found, provenance = load(tmp_path / "new" / "toy.h5", "toy")
    np.testing.assert_array_equal(found["speed_m_s"], [1.0, np.nan, 3.0])
    assert provenance == origin


def test_the_same_content_gives_the_same_bytes(tmp_path: Path) -> None:
    digests = set()
    for name in ("one.h5", "two.h5"):
        save(tmp_path / name, dataset(), Provenance("toy"))
        digests.add(hashlib.sha256((tmp_path / name).read_bytes()).hexdigest())
    assert len(digests) == 1


def test_plain_h5py_sees_units_and_dimension_scales(tmp_path: Path) -> None:
    save(tmp_path / "toy.h5", dataset().assign_coords(phase=[0.1, 0.2, 0.3]), Provenance("toy"))
    with h5py.File(tmp_path / "toy.h5") as file:
        assert file["speed_m_s"].attrs["units"] == "m s-1"
        assert file["speed_m_s"].dims[0][0].name == "/phase"
        assert file["phase"].attrs["units"] == "1"
        assert file.attrs["kind"] == "toy"


def test_columns_of_theta_in_another_order_are_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = {"toy": {"/": {"theta": Variable("parameter", "1", "columns by position")}}}
    monkeypatch.setattr(schema, "SCHEMAS", columns)
    theta = xr.Dataset({"theta": ("parameter", np.ones(3), {"units": "1"})})
    save(tmp_path / "right.h5", theta.assign_coords(parameter=list(THETA_NAMES)), Provenance("toy"))
    with pytest.raises(ArtefactError, match=r"has parameters \['k_sr_per_s', .* expected \['k0_kpa', "):
        save(tmp_path / "toy.h5", theta.assign_coords(parameter=list(THETA_NAMES[::-1])), Provenance("toy"))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (dataset(units="km/h"), "units"),
        (dataset().rename(phase="time"), "dimensions"),
        (dataset().rename(speed_m_s="speed"), "lacks"),
    ],
)
def test_content_that_differs_from_its_schema_is_not_written(
    tmp_path: Path, wrong: xr.Dataset, message: str
) -> None:
    with pytest.raises(ArtefactError, match=message):
        save(tmp_path / "toy.h5", wrong, Provenance("toy"))
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_another_kind_or_broken_is_named(tmp_path: Path) -> None:
    path = tmp_path / "toy.h5"
    save(path, dataset(), Provenance("toy"))
    with pytest.raises(ArtefactError, match="holds a 'toy' artefact, expected 'pool'"):
        load(path, "pool")
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ArtefactError, match=r"toy\.h5: has no checksum .* delete it and rerun"):
        load(path, "toy")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(RuntimeError), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError("interrupted")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
