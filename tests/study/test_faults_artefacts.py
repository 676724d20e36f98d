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

from swesbi.__main__ import main
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
from swesbi.artefacts import provenance as provenance_module
from swesbi.artefacts.atomic import make_command, repair_command
from swesbi.artefacts.files import LENGTH, append_checksum
from swesbi.measurement.operator import PassiveBaseline
from swesbi.study.running import check_writable

NAME = "passive.h5"
PASSIVE = schema_of(PassiveBaseline)["/"]
Change = Callable[[h5py.File], None]


def passive() -> dict[str, Group]:
    """Return the group of a passive baseline."""
    return {
        "/": Group(
            {
                name: Array(
                    variable.dims,
                    np.linspace(1.0, 2.0, 7) if variable.dims else np.array(2.0),
                    {"units": variable.units},
                )
                for name, variable in PASSIVE.items()
            }
        )
    }


def write_hdf5(path: Path) -> None:
    PassiveBaseline.save(path, passive(), Provenance("passive", "A", 3, {"b": 3.0}, "cafe"))


def test_what_is_whole_is_read(tmp_path: Path) -> None:
    write_hdf5(tmp_path / NAME)
    PassiveBaseline.read(tmp_path / NAME)


def test_every_flipped_bit_is_found(tmp_path: Path) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    positions = {0, len(whole) - 1, len(whole) - LENGTH, *map(int, rng.integers(0, len(whole), 150))}
    for position in positions:
        flipped = bytearray(whole)
        flipped[position] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        with pytest.raises(DamagedArtefactError, match="checksum"):
            PassiveBaseline.read(path)


def test_every_truncation_and_addition_is_found(tmp_path: Path) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    whole = path.read_bytes()
    for length in (0, 1, LENGTH - 1, LENGTH, len(whole) // 2, len(whole) - LENGTH, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(DamagedArtefactError, match="no checksum at its end: it was cut off"):
            PassiveBaseline.read(path)
    path.write_bytes(whole + b"\n")
    with pytest.raises(DamagedArtefactError, match="no checksum"):
        PassiveBaseline.read(path)


@pytest.fixture
def snakemake_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """The shell knows Snakemake by its name, as in an environment that is active."""
    beside = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{beside}{os.pathsep}{os.environ['PATH']}")


def test_snakemake_is_named_by_its_path_where_the_shell_does_not_know_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    beside = Path(sys.executable).with_name("snakemake")
    monkeypatch.chdir(tmp_path)
    assert make_command([Path("a.h5")]) == f"{shlex.quote(str(beside))} --cores 2 a.h5"


@pytest.mark.usefixtures("snakemake_is_known")
def test_the_message_names_file_fault_and_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("results") / "a b" / NAME
    write_hdf5(path)
    path.write_bytes(path.read_bytes()[:-90])
    with pytest.raises(DamagedArtefactError) as caught:
        PassiveBaseline.read(path)
    command = f"rm -f 'results/a b/{NAME}' && snakemake --cores 2 'results/a b/{NAME}'"
    assert str(caught.value).startswith(f"results/a b/{NAME}: has no checksum")
    assert str(caught.value).endswith(f"delete it and rerun: {command}")
    assert caught.value.message("--configfile x.yaml").endswith(f"{command} --configfile x.yaml")
    assert repair_command(path.absolute()) == command
    assert make_command([path.absolute(), Path("b")], "-n") == f"{command.split(' && ')[1]} b -n"


def test_an_older_schema_is_refused_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / NAME
    current = provenance_module.SCHEMA_VERSION
    older = {**Provenance("x").attributes(), "schema_version": 1}
    with monkeypatch.context() as patch:
        patch.setattr(
            Provenance, "attributes", lambda self: {**older, "kind": self.kind, "subject": self.subject}
        )
        write_hdf5(path)
    message = f"has schema version 1, this swesbi reads {current}; delete it and rerun: rm -f "
    with pytest.raises(DamagedArtefactError, match=message):
        PassiveBaseline.read(path)
    # as they were written when there were no checksums
    path.write_bytes(path.read_bytes()[:-LENGTH])
    with pytest.raises(DamagedArtefactError, match=message):
        PassiveBaseline.read(path)


@pytest.mark.usefixtures("snakemake_is_known")
def test_a_missing_artefact_is_named_with_the_command_that_makes_it(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match=r"nowhere\.h5: no such file; make it: rm -f .* snakemake"):
        PassiveBaseline.load(tmp_path / "nowhere.h5")


def test_the_checksum_needs_nothing_but_coreutils(tmp_path: Path) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    computed = subprocess.run(
        f"head -c -{LENGTH} passive.h5 | sha256sum", shell=True, cwd=tmp_path, capture_output=True, text=True
    )
    assert path.read_bytes()[-LENGTH:].decode() == f"\nswesbi sha256 {computed.stdout.split()[0]}\n"


def altered(path: Path, change: Change) -> None:
    """Change an artefact as other software would, and give it a right checksum again."""
    path.write_bytes(path.read_bytes()[:-LENGTH])
    with h5py.File(path, "a") as file:
        change(file)
    append_checksum(path)


def as_text(file: h5py.File) -> None:
    del file["scale_kpa"]
    file["scale_kpa"] = "two"
    file["scale_kpa"].attrs["units"] = "kPa"


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((7,), np.float64)
    layout[:] = h5py.VirtualSource("/etc/hostname", "x", (7,))
    file.create_virtual_dataset("other", layout)


def nested(file: h5py.File) -> None:
    file["group/in/a/group"] = 1.0


def looping(file: h5py.File) -> None:
    file["loop"] = file["/"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda file: file.__delitem__("scale_kpa"), "lacks .'scale_kpa'"),
        (lambda file: file["scale_kpa"].attrs.__setitem__("units", "Pa"), "units 'Pa', not 'kPa'"),
        (as_text, "holds .*, expected numbers"),
        (
            lambda file: file.__setitem__("other", h5py.ExternalLink("/etc/passwd", "/")),
            "a link to elsewhere",
        ),
        (lambda file: file.__setitem__("other", h5py.SoftLink("/stretch")), "a link to elsewhere"),
        (virtual, "takes its data from another file"),
        (
            lambda file: file.create_dataset("bomb", (10**15,), "f4", chunks=(1024,)),
            "claims 4000000000000000 bytes",
        ),
        (nested, "nested too deeply"),
        (looping, "nested too deeply"),
        (lambda file: file.attrs.__delitem__("settings"), "cannot be read as a swesbi artefact"),
        (lambda file: file.attrs.__setitem__("settings", "{"), "cannot be read as a swesbi artefact"),
        (lambda file: file.attrs.__setitem__("seed", "three"), "cannot be read as a swesbi artefact"),
        (lambda file: file.attrs.__setitem__("schema_version", 99), "has schema version 99"),
    ],
)
def test_hdf5_from_elsewhere_is_checked_before_use(tmp_path: Path, change: Change, message: str) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    altered(path, change)
    with pytest.raises(DamagedArtefactError, match=message):
        PassiveBaseline.read(path)


def test_a_changed_artefact_has_no_checksum_any_more(tmp_path: Path) -> None:
    path = tmp_path / NAME
    write_hdf5(path)
    with h5py.File(path, "a") as file:
        file["scale_kpa"][()] = 3.0
    with pytest.raises(DamagedArtefactError, match="checksum"):
        PassiveBaseline.read(path)


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (errno.ENOSPC, "the disk is full: free some space"),
        (errno.EDQUOT, "quota is used up"),
        (errno.EROFS, "read-only file system"),
        (errno.EIO, "input/output error"),
    ],
)
def test_what_cannot_be_written_is_named_and_leaves_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    number: int,
    message: str,
) -> None:
    def half_written(path: Path, content: bytes) -> int:
        with path.open("wb") as file:
            file.write(bytes(content[: len(content) // 2]))
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "write_bytes", half_written)
    with pytest.raises(ArtefactError, match=rf"{NAME}: cannot be written, .*{message}"):
        write_hdf5(tmp_path / NAME)
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_a_folder_is_named_by_where_it_was_to_lie(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(ArtefactError) as caught, folder_made_whole(tmp_path / "answer") as made:
        write_hdf5(made / NAME)
    assert str(caught.value).startswith(f"{tmp_path / 'answer' / NAME}: cannot be written, the disk is full")
    assert list(tmp_path.iterdir()) == []


def test_an_empty_cohort_is_written_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(path: Path, text: str, **how: str) -> int:
        if path.name == "_example.csv":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with path.open("w", **how) as file:
            return file.write(text)

    monkeypatch.setattr(Path, "write_text", full)
    assert main(["template", str(tmp_path / "clinic")]) == 2
    assert f"{tmp_path / 'clinic'}: cannot be written, the disk is full" in capsys.readouterr().err
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


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "touch", refused)
    message = r"t\.csv: cannot be written, permission denied"
    with pytest.raises(ArtefactError, match=message), atomic_path(tmp_path / "t.csv"):
        raise AssertionError("not reached")


def test_errors_of_another_nature_pass(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "t.csv"):
        Path(tmp_path / "nowhere").read_text()


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
