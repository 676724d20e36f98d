"""The blocks of the page on results run as they are printed, in a finished study."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from study_copy import ROOT, StudyCopy

BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def code_of(language: str) -> str:
    blocks = BLOCK.findall((ROOT / "docs" / "results.md").read_text(encoding="utf-8"))
    return "\n".join(code for kind, code in blocks if kind == language)


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
