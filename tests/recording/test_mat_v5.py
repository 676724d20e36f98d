"""The reader of MATLAB 5 files agrees with SciPy's, and stays within bounds where the file does not."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import loadmat, savemat

from swesbi.recording.mat_v5 import read_mat_v5
from swesbi.recording.mat_values import MatValueError

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


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (doubles("<", b"x", [1.0, 2.0], (3, 1)), "x with 2 of 3 values"),
        (doubles("<", b"x", [1.0], (-1, 1)), "an array of dimensions .-1, 1."),
        (doubles("<", b"x", [1.0], (2**31 - 1, 2**31 - 1)), "x: is an array of 2147483647 x 2147483647"),
        (doubles("<", b"x", [1.0] * 4, (2, 2)), "x: is an array of 2 x 2; save one value"),
        (doubles("<", b"x", [1.0], (1, 1))[:-4], "it ends within"),
        (struct.pack("<IIII", UINT32, 8, 6, 0), "an array without its flags, dimensions and name"),
        (element("<", UINT32, struct.pack("<II", 17, 0)) + element("<", INT8, b"x") * 2, "MATLAB object"),
        (b"\xff" * 64, "it ends within a value"),
    ],
)
def test_what_does_not_follow_the_format_is_refused(tmp_path: Path, matrix: bytes, message: str) -> None:
    (tmp_path / "S.mat").write_bytes(file("<", matrix))
    with pytest.raises(MatValueError, match=message):
        read_mat_v5(tmp_path / "S.mat", ["x"])


def test_a_value_that_swells_beyond_reason_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    savemat(tmp_path / "S.mat", {"x": np.zeros(100_000)}, do_compression=True)
    assert (tmp_path / "S.mat").stat().st_size < 2000
    monkeypatch.setattr("swesbi.recording.mat_v5.MAX_BYTES", 10_000)
    with pytest.raises(MatValueError, match="cut off, or larger than a recording can be"):
        read_mat_v5(tmp_path / "S.mat", ["x"])
