"""The blocks of the README's first screen and of the page on results run as printed, in a finished study."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from pages import blocks_of, typed
from study_copy import RESULTS, ROOT, StudyCopy

README, OF_A_STUDY = ROOT / "README.md", ROOT / "docs" / "results.md"


def code_of(language: str) -> str:
    return "\n".join(block.code for block in blocks_of(OF_A_STUDY) if block.language == language)


@pytest.mark.slow
def test_results_open_as_the_page_prints_it(
    finished: StudyCopy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "results").symlink_to(finished.results)
    monkeypatch.chdir(tmp_path)
    exec(compile(code_of("python"), "results.md", "exec"), {})
    assert "k_atp_per_s" in capsys.readouterr().out
    for line in code_of("sh").splitlines():
        command = line.partition("#")[0].replace(".venv/bin/swesbi", f"{sys.executable} -m swesbi").split()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_the_readme_s_first_screen_runs_as_printed(
    own_study: StudyCopy, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """But for the folder of the small study, and the option that names it."""
    blocks = blocks_of(README)
    whole, subject, contents = [block.code for block in blocks if block.language == "sh"][1:4]
    made = own_study.results / "paper" / "subjects" / "A" / "ppc.png"
    before = made.read_bytes()
    made.unlink()
    for command in (subject, whole):
        small = command.strip().replace("results/", f"{RESULTS}/")
        typed(f"{small} --configfile {own_study.config}", own_study)
        assert made.read_bytes() == before
    assert own_study.planned() == set()
    (own_study.folder / "results").symlink_to(own_study.results)
    assert "k0_kpa" in typed(contents, own_study)
    monkeypatch.chdir(own_study.folder)
    (opened,) = [block.code for block in blocks if block.language == "python" and "h5py" in block.code]
    exec(compile(opened, "README.md", "exec"), {})
    assert len(capsys.readouterr().out.split()) >= 5


@pytest.mark.slow(minutes=0.2)
def test_the_set_up_of_the_readme_clones_and_installs(tmp_path: Path) -> None:
    set_up = next(block.code for block in blocks_of(README) if block.language == "sh")
    assert set_up.splitlines()[-1] == "make install"
    named = set_up.replace("ADDRESS", shlex.quote(str(ROOT))).replace("make ", "make --dry-run ")
    done = subprocess.run(["bash", "-ec", named], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "--requirement environment.txt" in done.stdout
