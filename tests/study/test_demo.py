"""The demonstration, in a checkout and by a wheel in an empty folder: six lines, figures, a page."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi.answers.written import OUTPUTS
from swesbi.config.read import installation

WORDS = ("A: 20 of 20 gated phases", "k_0 ", "k_ATP ", "k_SR ", "verdict: not contradicted", "limit: with 8")


def check(said: str, folder: Path) -> None:
    """Six lines say what came out, one where it lies, and the intervals contain what made the recording."""
    lines = said.splitlines()
    assert len(lines) == 7
    assert all(line.startswith(word) for line, word in zip(lines, WORDS, strict=False))
    assert all(": contains the true " in line for line in lines[1:4])
    assert str(folder.resolve()) in lines[-1]
    assert set(OUTPUTS) <= {path.name for path in folder.iterdir()}


def test_a_checkout_is_what_commands_take_their_configuration_from() -> None:
    assert installation() == ROOT


@pytest.mark.slow(minutes=0.4)
def test_a_wheel_answers_in_an_empty_folder_where_there_is_no_checkout(tmp_path: Path) -> None:
    """What a wheel holds is unpacked alone: configuration, null distributions and recordings are inside."""
    source = shutil.copytree(
        ROOT, tmp_path / "source",
        ignore=shutil.ignore_patterns(".git", ".venv", "results*", ".snakemake", ".*_cache", "*.egg-info"),
    )  # fmt: skip
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*build, "--wheel-dir", str(tmp_path), str(source)], check=True)
    (wheel,) = tmp_path.glob("swesbi-*.whl")
    shutil.rmtree(source)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    empty = tmp_path / "empty"
    empty.mkdir()

    def typed(*given: str) -> subprocess.CompletedProcess[str]:
        environment = {
            "PYTHONPATH": str(tmp_path / "installed"),
            "PATH": "/usr/bin:/bin",
            "HOME": str(tmp_path),
        }
        command = [sys.executable, "-m", "swesbi", *given]
        return subprocess.run(command, cwd=empty, env=environment, capture_output=True, text=True)

    done = typed("demo")
    assert done.returncode == 0, done.stderr
    check(done.stdout, empty / "swesbi-demo")
    begun = typed("template", "mine")
    assert begun.returncode == 0, begun.stderr
    shipped = tmp_path / "installed" / "swesbi" / "shipped" / "data" / "virtual_volunteers"
    assert typed("validate", str(shipped)).returncode == 0
    told = typed("infer", str(shipped / "swe" / "B.csv"))
    assert told.returncode == 0, told.stderr
    assert told.stdout.startswith("B is answered from the prior of calibrated")
    assert (empty / "answers" / "virtual_volunteers" / "B" / "sheet.pdf").is_file()
