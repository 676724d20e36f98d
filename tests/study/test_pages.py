"""The pages do what they show: code runs as printed, and prints what stands below it."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from pages import PAGES, alike, blocks_of, pasted, walk
from study_copy import ROOT, copy_study

from swesbi.study.infer import ANSWERS
from swesbi.study.parsers import DEMO_OUT
from tools.notebook import code_cells, outputs, printed

COMMANDS_RUN = ("docs/tutorial.md", "docs/own-data.md")
"""Pages whose commands run, too: they are short, and need no study."""
OF_A_STUDY = ROOT / "docs" / "results.md"
"""Its blocks need a finished study: `test_results_page.py` runs them."""
NOTEBOOK = ROOT / "docs" / "examples" / "laboratory.ipynb"
NOT_RUN = 6
"""Blocks that would run but for their mark: they install, take minutes, or need a reader's own file."""
FOLDERS = re.compile(r"(?:template|validate|infer|--cohort|--plot|--out|cohort:|results:) ([a-z][\w./-]*\w)")
"""What commands and settings of the pages name: a cohort, or where something is written."""
WITH_CODE = [page for page in PAGES if any(block.language == "python" for block in blocks_of(page))]
WALKED = sorted({*WITH_CODE, *(ROOT / page for page in COMMANDS_RUN)} - {OF_A_STUDY})


def test_all_python_is_python_and_few_blocks_are_left_out() -> None:
    blocks = [block for page in PAGES for block in blocks_of(page)]
    for block in blocks:
        if block.language == "python":
            compile(block.code, block.place, "exec")
    run = [block for block in blocks if block.language == "python" or block.page in COMMANDS_RUN]
    assert len([block for block in run if not block.runs]) == NOT_RUN


def test_recordings_and_answers_where_the_pages_have_them_are_not_added_to_git() -> None:
    code = "\n".join(block.code for page in PAGES for block in blocks_of(page))
    named = set(FOLDERS.findall(code)) | {ANSWERS, DEMO_OUT}
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    made = {name for name in named if not re.search(rf"^{re.escape(name)}\b", tracked, re.MULTILINE)}
    assert made >= {"data/my_cohort", "my-cohort", "sheets", "answers", "swesbi-demo", "results-mine"}
    for name in made:
        asked = ["git", "check-ignore", "--quiet", f"{name}/subjects.csv"]
        assert subprocess.run(asked, cwd=ROOT, check=False).returncode == 0, f"{name} is not ignored"
    hidden = ["git", "ls-files", "--cached", "--ignored", "--exclude-standard"]
    assert subprocess.run(hidden, cwd=ROOT, capture_output=True, text=True, check=True).stdout == ""


@pytest.mark.slow(minutes=4)
@pytest.mark.parametrize("page", WALKED, ids=lambda page: page.name)
def test_a_page_runs_in_its_order_and_prints_what_it_shows(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = copy_study(tmp_path / "project")
    monkeypatch.chdir(study.folder)
    plt.switch_backend("Agg")
    blocks = blocks_of(page)
    printed = walk(blocks, study, shell=str(page.relative_to(ROOT)) in COMMANDS_RUN)
    for said, shown in pasted(blocks, printed):
        for line in filter(str.strip, shown.splitlines()):
            assert any(alike(line, other) for other in said.splitlines()), f"{line!r} is not in\n{said}"


def test_the_readme_shows_what_the_tutorial_s_first_command_prints() -> None:
    of_readme, of_tutorial = (
        [block.code for block in blocks_of(ROOT / page) if block.language == "text"]
        for page in ("README.md", "docs/tutorial.md")
    )
    assert of_readme[0] == of_tutorial[0]


@pytest.mark.slow(minutes=0.3)
def test_the_notebook_prints_and_draws_what_it_keeps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(copy_study(tmp_path / "project").folder)
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    for cell, made in zip(code_cells(notebook), outputs(notebook), strict=True):
        kept = cell["outputs"]
        assert [each["output_type"] for each in kept] == [each["output_type"] for each in made]
        lines, now = (printed(each).splitlines() for each in (kept, made))
        assert len(lines) == len(now) and all(map(alike, lines, now)), "".join(cell["source"])
