"""Machines that people have: groups that share a folder, other shells, folders with any name."""

from __future__ import annotations

import logging
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
import venv
from collections.abc import Mapping
from pathlib import Path

import pytest
from numba.core.caching import CompileResultCacheImpl
from study_copy import ROOT, copy_study, without_home

from swesbi.__main__ import main
from swesbi.artefacts import write_json
from swesbi.heart import compiled

RECORDINGS = str(ROOT / "data" / "virtual_push_trains")
VALIDATE = (sys.executable, "-m", "swesbi", "validate", RECORDINGS)


def ended(*command: str, cwd: Path = ROOT, env: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a command; what it says is kept."""
    return subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("umask", "mode"), [(0o077, 0o600), (0o022, 0o644), (0o002, 0o664)])
def test_files_have_the_permissions_that_the_umask_leaves(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        write_json(tmp_path / "verdict.json", {})
    finally:
        os.umask(before)
    assert (tmp_path / "verdict.json").stat().st_mode & 0o777 == mode


class Passing:
    """Sends a signal to this process as it is removed, where Python raises nothing."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def __del__(self) -> None:
        os.kill(os.getpid(), self.number)


class HalfMade:
    """Complains as it is removed, as an object does of whose attributes a signal has kept some away."""

    def __del__(self) -> None:
        raise AttributeError("half made")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("unseen", [False, True])
def test_a_signal_ends_a_command_with_a_sentence_and_does_not_stop_its_cleaning(
    number: signal.Signals, code: int, unseen: bool, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    cleaned = []

    def interrupted(_: object) -> int:
        half_made = HalfMade()  # noqa: F841
        try:
            Passing(number) if unseen else os.kill(os.getpid(), number)
            time.sleep(10)
            return 0
        finally:
            os.kill(os.getpid(), number)
            cleaned.append(True)

    monkeypatch.setattr("swesbi.__main__._run", interrupted)
    assert main(["validate"]) == code
    said = "\nswesbi: interrupted; of what was being made nothing is left behind\n"
    assert capsys.readouterr().err == said
    assert cleaned


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("given", [["--workers", "1"], ["--workers", "2"]])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_inference_and_leaves_nothing(
    given: list[str], number: signal.Signals, tmp_path: Path
) -> None:
    cohort = str(ROOT / "data" / "virtual_volunteers")
    command = [sys.executable, "-m", "swesbi", "infer", cohort, "--from-prior", *given, "--out"]
    running = subprocess.Popen(
        [*command, str(tmp_path / "out")], cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    time.sleep(6)
    running.send_signal(number)
    assert "Traceback" not in running.communicate(timeout=5)[1]
    assert running.returncode == 128 + number
    with pytest.raises(ProcessLookupError):
        os.killpg(running.pid, 0)
    assert not list(tmp_path.iterdir())


def test_a_reader_that_has_enough_is_no_fault() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(VALIDATE, stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_a_full_disk_below_what_is_printed_is_an_error() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(VALIDATE, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "what is printed: cannot be written, the disk is full" in done.stderr


def test_where_no_folder_takes_machine_code_the_model_runs_and_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(CompileResultCacheImpl, "_locator_classes", [])
    monkeypatch.setattr(logging.getLogger("swesbi"), "propagate", True)
    assert compiled.kernel(lambda x: x + 1)(2) == 3
    assert "set NUMBA_CACHE_DIR" in caplog.text


def test_numbers_within_braces_on_the_command_line_are_numbers(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    target, given = "results-smoke/amortised/calibration.h5", "resources={population_parts: 3}"
    done = study.snakemake(target, "--dry-run", "--config", given)
    assert "results-smoke/amortised/calibration/part-2.h5" in done.stdout + done.stderr


@pytest.mark.slow(minutes=0.2)
def test_an_environment_in_a_folder_with_blanks_is_refused_with_the_way_out(tmp_path: Path) -> None:
    """Snakemake writes the path of its Python into shell lines as it is."""
    study = copy_study(tmp_path / "Müller's a [b] & R")
    (study.folder / ".venv").symlink_to(Path(sys.prefix))
    command = [str(study.folder / ".venv" / "bin" / "python"), "-m", "snakemake", "--cores", "1"]
    target = ["--configfile", "smoke.yaml", "--", "results-smoke/cohort/A/passive.h5"]
    environment = {**os.environ, "PYTHONPATH": str(study.folder / "src")}
    done = ended(*command, *target, cwd=study.folder, env=environment)
    assert done.returncode != 0
    assert "rename the folder, or link to it (ln -s " in done.stderr
    assert "Traceback" not in done.stderr
    assert not (study.folder / "results-smoke").exists()


@pytest.mark.slow(minutes=0.5)
def test_networks_may_lie_in_a_folder_with_a_blank_in_its_name(tmp_path: Path) -> None:
    study = copy_study(tmp_path)
    network = study.folder / "other networks" / "calibrated" / "flow.h5"
    network.parent.mkdir(parents=True)
    network.write_bytes(b"a network")
    study.run("results-smoke/calibrated/flow.h5", "--config", "networks=other networks", cores=1)
    assert (study.results / "calibrated" / "flow.h5").read_bytes() == b"a network"


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A project that was copied with its environment, which finds the code of the original."""
    original, copy = tmp_path / "original" / ".venv", tmp_path / "copy"
    venv.create(original, symlinks=True)
    (packages,) = original.glob("lib/python*/site-packages")
    (packages / "editable.pth").write_text(f"{ROOT / 'src'}\n{sysconfig.get_path('purelib')}\n")
    program = original / "bin" / "swesbi"
    program.write_text(
        f"#!{original}/bin/python\nimport sys\nfrom swesbi.__main__ import main\nsys.exit(main())\n"
    )
    program.chmod(0o755)
    shutil.copytree(original, copy / ".venv", symlinks=True)
    (copy / "src" / "swesbi").mkdir(parents=True)
    (copy / "src" / "swesbi" / "__init__.py").touch()
    for folder in (original.parent, copy):
        for name in ("Makefile", "locks/infer.txt", "pyproject.toml"):
            (folder / name).parent.mkdir(exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return copy


def test_a_copied_environment_says_that_it_runs_other_code(copied: Path) -> None:
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def typed(*command: str, **further: str) -> subprocess.CompletedProcess[str]:
        return ended(*command, cwd=copied, env=plain | further)

    original = copied.parent / "original" / ".venv" / "bin"
    renew = f"cd {copied} && rm -r .venv && make install"
    validate = ("validate", str(ROOT / "data" / "virtual_volunteers"), "--config", str(ROOT / "config.yaml"))
    for command in ([".venv/bin/python", "-m", "swesbi", *validate], [".venv/bin/swesbi", *validate]):
        refused = typed(*command)
        assert (refused.returncode, refused.stdout) == (2, "")
        assert renew in refused.stderr
        assert typed(*command, PYTHONPATH=str(ROOT / "src")).returncode == 0
    assert typed(str(original / "swesbi"), *validate).returncode == 0
    made = typed("make", "-n", "demo")
    assert made.returncode == 2
    assert "`rm -r .venv && make install`" in made.stderr
    assert typed("make", "-n", "help", "clean").returncode == 0
    assert typed("make", "-n", "demo", "-C", str(original.parents[1])).returncode == 0


def test_snakemake_of_another_environment_says_what_to_type() -> None:
    without = "import sys; sys.modules['swesbi'] = None; from snakemake.cli import main; main(sys.argv[1:])"
    done = ended(sys.executable, "-c", without, "--cores", "1", "--dry-run", env=os.environ)
    assert done.returncode != 0
    said = done.stdout + done.stderr
    assert f"{sys.prefix}, has no swesbi" in said and "Type `make install`" in said
    assert "Traceback" not in said


@pytest.mark.slow(minutes=0.5)
def test_a_recording_dated_in_the_future_is_refused_with_the_way_out(tmp_path: Path) -> None:
    """The clock of a scanner may be years ahead."""
    study = copy_study(tmp_path)
    ahead = time.time() + 3e8
    for name in ("swe/A.csv", "subjects.csv"):
        os.utime(study.folder / "data" / "virtual_volunteers" / name, (ahead, ahead))
    target = "results-smoke/cohort/A/observation.h5"
    refused = study.snakemake(target, cores=1)
    assert refused.returncode != 0 and "Job 0" not in refused.stderr
    command = refused.stderr.split("date it anew: ")[1].splitlines()[0]
    subprocess.run(command, shell=True, cwd=study.folder, check=True)
    study.run(target, cores=1)
    assert study.planned(target) == set()


@pytest.mark.slow(minutes=0.5)
def test_the_study_needs_no_home_and_runs_in_any_folder(tmp_path: Path) -> None:
    """Recordings and results are those of the project."""
    study = copy_study(tmp_path / "project")
    here = tmp_path / "here"
    here.mkdir()
    given = ["-s", str(study.folder / "Snakefile"), "--configfile", str(study.folder / "smoke.yaml")]
    made = study.results / "cohort" / "A" / "passive.h5"
    command = [sys.executable, "-m", "snakemake", "--cores", "1", str(made), *given]
    done = ended(*command, cwd=here, env=without_home(study.environment))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert made.is_file()


SMALL = ["--from-prior", "--overlay", str(ROOT / "tests" / "smoke.yaml")]


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize(
    "given",
    [
        ["validate", RECORDINGS, "--plot", "sheets"],
        ["infer", RECORDINGS, "--subject", "A", *SMALL, "--out", "a"],
        ["demo"],
    ],
    ids=" ".join,
)
def test_no_command_needs_a_home_or_passes_on_what_libraries_warn_of(
    given: list[str], tmp_path: Path
) -> None:
    """The shell's backend may be another; `compare` and `plan` run in tests/persons/test_change_study.py."""
    environment = without_home(os.environ) | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    done = ended(sys.executable, "-m", "swesbi", *given, cwd=tmp_path, env=environment)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert not [word for word in ("Traceback", "Warning", "matplotlib", "/proc/nowhere") if word in said]
