"""Pages of a finished study under axe-core: nothing serious keeps a reader from reading them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from accessibility import in_dark, serious
from browser import Browser

from swesbi.report.page.names import FURTHER

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("program")]

DESKTOP_PX, PHONE_PX = 1400, 400
LANDING = "index.html"
PAGES = (LANDING, *(f"report/{name}.html" for name in FURTHER))
EVERY_WAY = [(width_px, dark) for width_px in (DESKTOP_PX, PHONE_PX) for dark in (False, True)]
# further pages have the colours of the landing page, and the largest takes a while
CASES = [
    *((name, DESKTOP_PX, False) for name in PAGES),
    *((LANDING, *way) for way in EVERY_WAY[1:]),
]


@pytest.fixture(scope="module")
def results(program: str, request: pytest.FixtureRequest) -> Path:
    # asked for here, since pytest would otherwise run the study before it looks for the browser
    folder: Path = request.getfixturevalue("finished").results
    return folder


@pytest.mark.parametrize(("name", "width_px", "dark"), CASES)
def test_nothing_keeps_a_reader_from_reading(
    page: Browser, results: Path, name: str, width_px: int, dark: bool
) -> None:
    in_dark(page, dark=dark)
    page.open(results / name, width_px)
    found = serious(page)
    assert not found, json.dumps(found, indent=1)


def test_a_page_that_is_worse_is_found_out(page: Browser, results: Path) -> None:
    """Without its language, with pale text and a picture without words."""
    in_dark(page, dark=False)
    page.open(results / LANDING, DESKTOP_PX)
    page.evaluate("document.documentElement.removeAttribute('lang')")
    page.evaluate("document.querySelector('p').style.color = '#ddd'")
    page.evaluate("document.body.append(new Image())")
    assert {rule for _, rule, _ in serious(page)} >= {"html-has-lang", "color-contrast", "image-alt"}
