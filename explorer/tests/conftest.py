"""The explorer: of a finished small study that has it, and opened in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import explorer_case
import pytest
from browser import Browser, browser, find_browser, until
from small_study import finished
from study_copy import ROOT, StudyCopy, copy_tree, duplicate

__all__ = ["finished"]


@pytest.fixture
def study_with_page(finished: StudyCopy, tmp_path: Path) -> StudyCopy:  # noqa: F811
    """A finished small study to which this package was added: the page is made then, and what links to it."""
    study = duplicate(finished, tmp_path / "study")
    copy_tree(ROOT / "explorer", study.folder / "explorer")
    study.run()
    return study


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Browser, Path]]:
    find_browser()
    file = tmp_path_factory.mktemp("explorer") / "explorer.html"
    file.write_text(explorer_case.page(), encoding="utf-8")
    with browser() as made:
        yield made, file


@pytest.fixture
def page(opened: tuple[Browser, Path]) -> Iterator[Browser]:
    """The page once it has answered and drawn; when it is left, it has neither complained nor asked."""
    made, file = opened
    made.open(file, 1400)
    until(made, "document.body.dataset.drawn && document.body.dataset.answered")
    yield made
    assert made.complaints == []
    assert {urlsplit(address).scheme for address in made.requests} <= {"file", "blob"}
    assert [address for address in made.requests if address.startswith("file:")] == [file.resolve().as_uri()]
