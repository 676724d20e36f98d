"""MATLAB files before 7.3 are read as SciPy reads them, and refused by what they are."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse
from scipy.io import loadmat, savemat

from swesbi.recording.mat_child import read_mat_v5
from swesbi.recording.mat_table import read_mat_table
from swesbi.recording.problems import RecordingError

DOUBLE, INT8, INT32, UINT32 = 9, 1, 5, 6
KINDS = ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"]


def element(order: str, kind: int, body: bytes) -> bytes:
    return struct.pack(order + "II", kind, len(body)) + body + b"\0" * (-len(body) % 8)


def file(order: str, *matrices: bytes) -> bytes:
    ending = {"<": b"\x00\x01IM", ">": b"\x01\x00MI"}[order]
    return (
        b"MATLAB 5.0 MAT-file".ljust(124) + ending + b"".join(element(order, 14, body) for body in matrices)
    )


def doubles(order: str, name: bytes, values: list[float], shape: tuple[int, ...]) -> bytes:
    return b"".join(
        [
            element(order, UINT32, struct.pack(order + "II", 6, 0)),
            element(order, INT32, struct.pack(f"{order}{len(shape)}i", *shape)),
            element(order, INT8, name),
            element(order, DOUBLE, struct.pack(f"{order}{len(values)}d", *values)),
        ]
    )


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize("kind", KINDS)
def test_numbers_of_every_class(tmp_path: Path, kind: str, compressed: bool) -> None:
    values = (np.random.default_rng(1).uniform(0, 100, 37)).astype(kind)
    path = tmp_path / "S.mat"
    savemat(
        path, {"x": values, "s": {"x": values[:3], "y": 1.0}, "unread": "text"}, do_compression=compressed
    )
    read = read_mat_v5(path, ["x", "y"])
    assert list(read) == ["x"]
    np.testing.assert_array_equal(read["x"], loadmat(path)["x"].ravel().astype(float))


def test_a_struct_among_other_variables(tmp_path: Path) -> None:
    texts: NDArray[Any] = np.array(["ok", "", "größer", "no_wave"], dtype=object)
    savemat(tmp_path / "S.mat", {"rec": {"x": np.arange(4.0), "status": texts}, "other": np.eye(3)})
    read = read_mat_v5(tmp_path / "S.mat", ["x", "status"])
    np.testing.assert_array_equal(read["x"], np.arange(4.0))
    assert list(read["status"]) == ["ok", "", "größer", "no_wave"]


@pytest.mark.parametrize("order", ["<", ">"])
def test_either_byte_order(tmp_path: Path, order: str) -> None:
    (tmp_path / "S.mat").write_bytes(file(order, doubles(order, b"x", [1.5, -2.0, 1e300], (3, 1))))
    np.testing.assert_array_equal(read_mat_v5(tmp_path / "S.mat", ["x"])["x"], [1.5, -2.0, 1e300])


@pytest.mark.parametrize("version", [5, 7.3])
def test_an_array_of_structs_is_read_as_the_struct_of_its_columns(tmp_path: Path, version: float) -> None:
    """What table2struct(T) writes without 'ToScalar': one struct a row."""
    rows = [(1.5, "ok"), (2.5, "no_wave"), (np.nan, "ok")]
    path = tmp_path / "S.mat"
    if version == 5:
        savemat(path, {"T": np.array(rows, dtype=[("x", object), ("status", object)])})
    else:
        with h5py.File(path, "w", userblock_size=512) as file:
            group = file.create_group("T")
            group.attrs["MATLAB_class"] = np.bytes_("struct")
            for name, column in zip(("x", "status"), zip(*rows, strict=True), strict=True):
                group.create_dataset(name, data=references(file, name, column), dtype=h5py.ref_dtype)
        path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + path.read_bytes()[128:])
    table = read_mat_table(path, ("x", "status"))
    assert table.cells["x"].tolist() == ["1.5", "2.5", "NaN"]
    assert table.cells["status"].tolist() == ["ok", "no_wave", "ok"]


def references(file: h5py.File, name: str, values: tuple[object, ...]) -> NDArray[np.object_]:
    """One dataset a value, as MATLAB lays out the field of an array of structs."""
    found = np.empty((1, len(values)), dtype=h5py.ref_dtype)
    for index, value in enumerate(values):
        text = isinstance(value, str)
        data = (
            np.frombuffer(value.encode("utf-16-le"), "<u2")[:, None] if isinstance(value, str) else [[value]]
        )
        cell = file.create_dataset(f"#refs#/{name}{index}", data=data)
        cell.attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
        found[0, index] = cell.ref
    return found


@pytest.mark.parametrize("kept", [100, 128, 150, 400])
def test_a_file_that_is_cut_off_is_refused(tmp_path: Path, kept: int) -> None:
    savemat(tmp_path / "S.mat", {"x": np.random.default_rng(1).uniform(size=500)}, do_compression=True)
    (tmp_path / "S.mat").write_bytes((tmp_path / "S.mat").read_bytes()[:kept])
    with pytest.raises(RecordingError, match=r"cannot be read as a .mat file|lacks the columns x"):
        read_mat_table(tmp_path / "S.mat", ("x",))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.eye(2), "x': is an array of 2 x 2; save one value"),
        (np.array([1j, 2.0]), "is complex"),
        (sparse.eye_array(3), "is a sparse matrix"),
        (np.zeros(6_000_000, dtype=np.int8), "has more values than a recording"),
    ],
)
def test_what_is_no_vector_is_refused_by_what_it_is(tmp_path: Path, value: object, message: str) -> None:
    savemat(tmp_path / "S.mat", {"x": value}, do_compression=True)
    with pytest.raises(RecordingError, match=message):
        read_mat_table(tmp_path / "S.mat", ("x",))
