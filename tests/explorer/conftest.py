"""The explorer, opened in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import explorer_case
import pytest
from browser import Browser, browser, find_browser, until


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
