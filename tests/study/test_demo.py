"""The demonstration in a checkout, and a wheel in an empty environment of newest versions."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi.answers.files import OUTPUTS
from swesbi.base.environment import missing

WORDS = ("G: 20 of 20 gated phases", "k_0 ", "k_ATP ", "k_SR ", "verdict: not contradicted", "limit: with 8")
NEWER = ("3.14", "3.13", "3.12")
OPENED = """
import sys, arviz, swesbi
opened = arviz.from_netcdf(sys.argv[1], engine="h5netcdf")
assert {"k0_kpa", "k_atp_per_s", "k_sr_per_s"} <= set(opened.posterior.data_vars)
assert len(arviz.summary(opened.posterior.to_dataset()[["k0_kpa"]], kind="stats")) == 1
answer = swesbi.infer(swesbi.read_recording(sys.argv[2]))
assert answer.attrs["status"] == "not contradicted" and answer.posterior.k0_kpa.sizes["chain"] == 1
"""


def check(said: str, folder: Path) -> None:
    """Six lines say what came out, one where it lies, and the intervals contain what made the recording."""
    lines = said.splitlines()
    assert len(lines) == 7
    assert all(line.startswith(word) for line, word in zip(lines, WORDS, strict=False))
    assert all(": contains the true " in line for line in lines[1:4])
    assert str(folder.resolve()) in lines[-1]
    assert set(OUTPUTS) <= {path.name for path in folder.iterdir()}


def newer_python() -> str:
    """Return a Python above 3.11 that runs, on the path or of pyenv; skip the test where there is none."""
    folders = sorted((Path.home() / ".pyenv" / "versions").glob("3.*/bin"))
    path = os.pathsep.join([os.environ["PATH"], *map(str, folders)])
    for version in NEWER:
        for folder in path.split(os.pathsep):
            program = shutil.which(f"python{version}", path=folder)
            if program and subprocess.run([program, "-c", ""], check=False).returncode == 0:
                return program
    pytest.skip("no Python 3.12 or newer is on this machine: a wheel was installed under 3.11 alone")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    passing = (".git", ".venv", "results", "results-*", ".snakemake", ".*_cache", "*.egg-info")
    source = shutil.copytree(ROOT, folder / "source", ignore=shutil.ignore_patterns(*passing))
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*build, "--wheel-dir", str(folder), str(source)], check=True)
    (made,) = folder.glob("swesbi-*.whl")
    shutil.rmtree(source)
    return made


def installed(wheel: Path, python: str, folder: Path, *further: str) -> Path:
    """Return the Python of an empty environment with the wheel and the newest of each dependency."""
    subprocess.run([python, "-m", "venv", str(folder)], check=True)
    program = folder / "bin" / "python"
    pip = [str(program), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, str(wheel), *further], check=True)
    return program


@pytest.mark.slow(minutes=2)
@pytest.mark.parametrize("newer", [True, False], ids=["newer", "oldest"])
def test_a_wheel_answers_where_there_is_no_checkout(newer: bool, wheel: Path, tmp_path: Path) -> None:
    """It has configuration, null distributions and recordings; neither torch nor Snakemake is there."""
    further = ["arviz"] if newer else []  # of which newer versions of Python get another generation
    program = installed(wheel, newer_python() if newer else sys.executable, tmp_path / "made", *further)
    empty = tmp_path / "empty"
    empty.mkdir()

    def typed(*given: str) -> subprocess.CompletedProcess[str]:
        environment = {"PATH": "/usr/bin:/bin", "HOME": "/proc/nowhere", "OMP_NUM_THREADS": "1"}
        done = subprocess.run(
            [str(program), *given], cwd=empty, env=environment, capture_output=True, text=True, check=False
        )
        assert "Warning" not in done.stderr, done.stderr
        return done

    demo = typed("-m", "swesbi", "demo")
    assert demo.returncode == 0, demo.stderr
    check(demo.stdout, empty / "swesbi-demo")
    assert typed("-m", "swesbi", "template", "mine").returncode == 0
    shipped = next((tmp_path / "made").glob("lib/python*/site-packages/swesbi/shipped"))
    volunteers = shipped / "data" / "virtual_volunteers"
    assert typed("-m", "swesbi", "validate", str(volunteers)).returncode == 0
    told = typed("-m", "swesbi", "infer", str(volunteers / "swe" / "B.csv"))
    assert told.returncode == 0, told.stderr
    assert (empty / "answers" / "virtual_volunteers" / "B" / "sheet.pdf").is_file()
    assert typed("-m", "swesbi", "inspect", "--check", "swesbi-demo").returncode == 0
    absent = typed("-c", "import swesbi; swesbi.torch_prior(None)")
    assert absent.stderr.splitlines()[-1].endswith(str(missing(ModuleNotFoundError(name="torch"))))
    if newer:
        opened = typed("-c", OPENED, "swesbi-demo/posterior.h5", str(volunteers / "swe" / "G.csv"))
        assert opened.returncode == 0, opened.stderr
