"""Fixtures of more than one module: a finished smoke study, and its results."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_copy import ROOT, StudyCopy, copy_study


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> StudyCopy:
    """A copy of the project whose smoke study has run on two cores; tests leave it as they found it."""
    study = copy_study(tmp_path_factory.mktemp("study") / "two-cores")
    study.run()
    return study


@pytest.fixture
def local_results(request: pytest.FixtureRequest) -> Path:
    """Results of the smoke study on this machine: those of `make smoke` where nothing would rerun."""
    here = StudyCopy(ROOT, "tests/smoke.yaml")
    if here.results.is_dir() and not here.planned():
        return here.results
    finished: StudyCopy = request.getfixturevalue("finished")
    return finished.results
