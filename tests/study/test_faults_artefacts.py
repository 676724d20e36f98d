"""Damaged, foreign and outdated artefacts are named and refused; a file that cannot be written says why."""

from __future__ import annotations

import errno
import fcntl
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from swesbi.artefacts import (
    Array,
    ArtefactError,
    DamagedArtefactError,
    Group,
    Provenance,
    atomic_path,
    folder_made_whole,
    schema_of,
)
from swesbi.artefacts.atomic import make_command, repair_command
from swesbi.artefacts.files import LENGTH, SCHEMA_VERSION, append_checksum
from swesbi.measurement.operator import PassiveBaseline
from swesbi.study.running import check_writable

NAME = "passive.h5"
MADE = Provenance("toy", "A", 3, {"b": 3.0}, "cafe")
Change = Callable[[h5py.File], None]


def write_hdf5(path: Path) -> None:
    arrays = {}
    for name, variable in schema_of(PassiveBaseline)["/"].items():
        values = np.linspace(1.0, 2.0, 7) if variable.dims else np.array(2.0)
        arrays[name] = Array(variable.dims, values, {"units": variable.units})
    PassiveBaseline.save(path, {"/": Group(arrays)}, MADE)


def test_every_flipped_bit_truncation_and_addition_is_found(tmp_path: Path) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    PassiveBaseline.read(path)
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    for position in {0, len(whole) - 1, len(whole) - LENGTH, *map(int, rng.integers(0, len(whole), 150))}:
        flipped = bytearray(whole)
        flipped[position] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        with pytest.raises(DamagedArtefactError, match="checksum"):
            PassiveBaseline.read(path)
    for length in (0, 1, LENGTH - 1, LENGTH, len(whole) // 2, len(whole) - LENGTH, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(DamagedArtefactError, match="no checksum at its end: it was cut off"):
            PassiveBaseline.read(path)
    path.write_bytes(whole + b"\n")
    with pytest.raises(DamagedArtefactError, match="no checksum"):
        PassiveBaseline.read(path)


def test_the_message_names_file_fault_and_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("results") / "a b" / "passive.h5"
    write_hdf5(path)
    path.write_bytes(path.read_bytes()[:-90])
    beside = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{beside}{os.pathsep}{os.environ['PATH']}")
    with pytest.raises(DamagedArtefactError) as caught:
        PassiveBaseline.read(path)
    command = "rm -f 'results/a b/passive.h5' && snakemake --cores 2 'results/a b/passive.h5'"
    assert str(caught.value).startswith("results/a b/passive.h5: has no checksum")
    assert str(caught.value).endswith(f"delete it and rerun: {command}")
    assert caught.value.message("--configfile x.yaml").endswith(f"{command} --configfile x.yaml")
    assert repair_command(path.absolute()) == command
    with pytest.raises(ArtefactError, match=r"nowhere\.h5: no such file; make it: rm -f .* snakemake"):
        PassiveBaseline.load(tmp_path / "nowhere.h5")
    monkeypatch.setenv("PATH", str(tmp_path))  # where no shell knows Snakemake
    assert make_command([Path("a.h5")]) == f"{shlex.quote(str(beside / 'snakemake'))} --cores 2 a.h5"


def test_the_checksum_needs_nothing_but_coreutils(tmp_path: Path) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    computed = subprocess.run(
        f"head -c -{LENGTH} passive.h5 | sha256sum", shell=True, cwd=tmp_path, capture_output=True, text=True
    )
    assert path.read_bytes()[-LENGTH:].decode() == f"\nswesbi sha256 {computed.stdout.split()[0]}\n"


def as_text(file: h5py.File) -> None:
    del file["scale_kpa"]
    file["scale_kpa"] = "two"
    file["scale_kpa"].attrs["units"] = "kPa"


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((7,), np.float64)
    layout[:] = h5py.VirtualSource("/etc/hostname", "x", (7,))
    file.create_virtual_dataset("other", layout)


def bomb(file: h5py.File) -> None:
    file.create_dataset("bomb", (10**15,), "f4", chunks=(1024,))


def attribute(name: str, value: object) -> Change:
    return lambda file: file.attrs.__setitem__(name, value)


def item(name: str, value: object) -> Change:
    return lambda file: file.__setitem__(name, value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda file: file.__delitem__("scale_kpa"), "lacks .'scale_kpa'"),
        (lambda file: file["scale_kpa"].attrs.__setitem__("units", "Pa"), "units 'Pa', not 'kPa'"),
        (as_text, "holds .*, expected numbers"),
        (item("other", h5py.ExternalLink("/etc/passwd", "/")), "a link to elsewhere"),
        (item("other", h5py.SoftLink("/stretch")), "a link to elsewhere"),
        (virtual, "takes its data from another file"),
        (bomb, "claims 4000000000000000 bytes"),
        (item("group/in/a/group", 1.0), "nested too deeply"),
        (lambda file: file.__setitem__("loop", file["/"]), "nested too deeply"),
        (lambda file: file.attrs.__delitem__("settings"), "cannot be read as a swesbi artefact"),
        (attribute("settings", "{"), "cannot be read as a swesbi artefact"),
        (attribute("seed", "three"), "cannot be read as a swesbi artefact"),
        (attribute("schema_version", 99), "has schema version 99"),
        (
            attribute("schema_version", 1),
            f"has schema version 1, this swesbi reads {SCHEMA_VERSION}; delete it and rerun: rm -f ",
        ),
    ],
)
def test_hdf5_from_elsewhere_is_checked_before_use(tmp_path: Path, change: Change, message: str) -> None:
    """Changed as other software would, with a right checksum again."""
    path = tmp_path / "passive.h5"
    write_hdf5(path)
    path.write_bytes(path.read_bytes()[:-LENGTH])
    with h5py.File(path, "a") as file:
        change(file)
    append_checksum(path)
    with pytest.raises(DamagedArtefactError, match=message):
        PassiveBaseline.read(path)


@pytest.mark.parametrize(
    ("number", "message"),
    [(errno.ENOSPC, "the disk is full: free some space"), (errno.EIO, "input/output error")],
)
def test_what_cannot_be_written_is_named_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, message: str
) -> None:
    """A file by itself, and one of a folder, which is named by where it was to lie."""

    def half_written(path: Path, content: bytes) -> int:
        with path.open("wb") as file:
            file.write(bytes(content[: len(content) // 2]))
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "write_bytes", half_written)
    with pytest.raises(ArtefactError, match=rf"{NAME}: cannot be written, .*{message}"):
        write_hdf5(tmp_path / NAME)
    with pytest.raises(ArtefactError) as caught, folder_made_whole(tmp_path / "answer") as made:
        write_hdf5(made / NAME)
    assert str(caught.value).startswith(f"{tmp_path / 'answer' / NAME}: cannot be written, ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [errno.EPERM, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS])
def test_a_file_system_without_permissions_synchronisation_and_locks_is_enough(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    for call in ("chmod", "fchmod", "fsync", "fdatasync"):
        monkeypatch.setattr(os, call, unknown)
    write_hdf5(tmp_path / NAME)
    check_writable(tmp_path)
    with (tmp_path / NAME).open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # a reader that locks fails now, as it does where there are no locks
        PassiveBaseline.read(tmp_path / NAME)
    assert [path.name for path in tmp_path.iterdir()] == [NAME]


@pytest.mark.parametrize("locking", [False, None, True])
def test_a_file_that_this_process_holds_open_is_read(tmp_path: Path, locking: bool | None) -> None:
    """A notebook does; the library opens it a second time under the same kind of lock alone."""
    write_hdf5(tmp_path / NAME)
    with h5py.File(tmp_path / NAME, "r", locking=locking):
        PassiveBaseline.read(tmp_path / NAME)


def test_a_folder_that_cannot_be_written_is_named_and_errors_of_another_nature_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "t.csv"):
        Path(tmp_path / "nowhere").read_text()

    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "touch", refused)
    message = r"t\.csv: cannot be written, permission denied"
    with pytest.raises(ArtefactError, match=message), atomic_path(tmp_path / "t.csv"):
        raise AssertionError("not reached")


def test_what_a_killed_writer_left_is_removed_and_a_living_writer_is_not_disturbed(tmp_path: Path) -> None:
    path = tmp_path / NAME
    dying = (
        "import os, signal, sys; from pathlib import Path; from swesbi.artefacts import atomic_path\n"
        "with atomic_path(Path(sys.argv[1])) as half:\n"
        "    half.write_bytes(b'half'); os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", dying, str(path)], check=False)
    (left,) = tmp_path.iterdir()
    assert left.read_bytes() == b"half"
    with atomic_path(path) as mine:
        assert not left.exists()
        write_hdf5(path)
        assert mine.exists()
    assert list(tmp_path.iterdir()) == [path]
