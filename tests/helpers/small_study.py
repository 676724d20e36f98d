"""Fixtures of tests that need a finished small study, made once per session for all workers."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from filelock import FileLock
from study_copy import StudyCopy, adopt_results, copy_study, duplicate


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> StudyCopy:
    """A copy of the project whose small study has finished; every worker has the same, so tests only read it.

    It starts from the results of ``make smoke``, if there are any, and Snakemake makes what is not current.
    """
    folder = shared_folder(tmp_path_factory) / "finished-study"
    with FileLock(f"{folder}.lock"):
        if not folder.exists():
            study = copy_study(tmp_path_factory.mktemp("unfinished") / "study")
            adopt_results(study)
            study.run()
            study.folder.rename(folder)
    return StudyCopy(folder)


def shared_folder(factory: pytest.TempPathFactory) -> Path:
    """Return the session's temporary folder; each of several workers has its own below it."""
    folder = factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


@pytest.fixture(scope="module")
def editable(finished: StudyCopy, tmp_path_factory: pytest.TempPathFactory) -> StudyCopy:
    """A finished study of a module's own: to edit and put back, and to ask what would rerun."""
    return duplicate(finished, tmp_path_factory.mktemp("editable") / "study")


@pytest.fixture
def own_study(finished: StudyCopy, tmp_path: Path) -> StudyCopy:
    """A finished study of a test's own, to be damaged or run again."""
    return duplicate(finished, tmp_path / "study")
