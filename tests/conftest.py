"""Fixtures of more than one module: a finished smoke study."""

from __future__ import annotations

import pytest
from study_copy import StudyCopy, copy_study


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> StudyCopy:
    """A copy of the project whose smoke study has run on two cores; tests leave it as they found it."""
    study = copy_study(tmp_path_factory.mktemp("study") / "two-cores")
    study.run()
    return study
