"""What tests that open pages share: the browser's program, and one browser a module."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser import Browser, browser, find_browser


@pytest.fixture(scope="module")
def program() -> str:
    """The browser's program; without one tests are skipped before any study is run, and fail in CI."""
    return find_browser()


@pytest.fixture(scope="module")
def page(program: str) -> Iterator[Browser]:
    with browser() as opened:
        yield opened
