"""Kinds of files that people have: each is read rightly, or refused with its place and what to do."""

from __future__ import annotations

import re
import shutil
import warnings
from pathlib import Path

import kinds
import pytest
from cohorts import snapshot
from study_copy import ROOT

from swesbi.__main__ import main


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cohort without a fault, to be copied."""
    return kinds.good(tmp_path_factory.mktemp("good") / "cohort")


@pytest.mark.parametrize("name", kinds.KINDS)
def test_it_is_read_or_refused_in_words_and_nothing_is_written(
    name: str, good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    cohort = Path(shutil.copytree(good, tmp_path / "cohort"))
    broken, message = kinds.KINDS[name]
    broken(cohort)
    before = snapshot(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code = main(["validate", str(cohort)])
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err
    if message.startswith(kinds.OK):
        assert code == 0, shown.err
        assert "3 recordings can be used" in shown.out
        assert re.search(message.removeprefix(kinds.OK), shown.out), shown.out
    else:
        assert code == 2, shown.out
        assert re.search(message, shown.err), shown.err
    assert snapshot(tmp_path) == before


def test_phases_that_were_typed_are_blamed_where_they_were_typed(
    good: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["validate", str(good), "--phases", "12"]) == 2
    shown = capsys.readouterr().err
    assert "protocol.phases is 20, but --phases is 12; correct the one that is wrong" in shown
    assert "config.yaml" not in shown
