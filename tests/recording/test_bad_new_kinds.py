"""Whatever is wrong with a recording of the new kinds is named with its place, value and remedy."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import free_case
import pytest
from bad_new_kinds import NEW_KINDS
from cohorts import snapshot
from study_copy import ROOT

from swesbi.__main__ import main


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cohort without a fault, to be copied."""
    return free_case.mixed(tmp_path_factory.mktemp("good") / "cohort")


@pytest.mark.parametrize("name", NEW_KINDS)
def test_it_is_refused_in_words_and_nothing_is_written(
    name: str, good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    cohort = Path(shutil.copytree(good, tmp_path / "cohort"))
    broken, message = NEW_KINDS[name]
    broken(cohort)
    before = snapshot(tmp_path)
    assert main(["validate", str(cohort), "--plot", str(tmp_path / "sheets")]) == 2
    shown = capsys.readouterr().err
    assert "Traceback" not in shown
    assert re.search(message, shown), shown
    assert snapshot(tmp_path) == before
