"""Pages and explorer of a finished study under axe-core: nothing serious keeps a reader from reading them."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from browser import Browser

from swesbi.show.page import FURTHER

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("program")]

DESKTOP_PX, PHONE_PX = 1400, 400
LANDING, EXPLORER = "report.html", "explorer.html"
PAGES = (LANDING, *(f"report/{name}.html" for name in FURTHER), EXPLORER)
EVERY_WAY = [(width_px, dark) for width_px in (DESKTOP_PX, PHONE_PX) for dark in (False, True)]
# further pages have the colours of the landing page, and the largest takes a while
CASES = [
    *((name, DESKTOP_PX, False) for name in PAGES),
    *((name, *way) for name in (LANDING, EXPLORER) for way in EVERY_WAY[1:]),
]
SERIOUS = ("serious", "critical")
AXE = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")
RUN = """axe.run(document, {resultTypes: ['violations'], preload: false})
    .then(found => found.violations.map(one => [one.impact, one.id, one.nodes[0].html]))"""
OPEN = "document.querySelectorAll('details').forEach(part => part.open = true)"


@pytest.fixture(scope="module")
def results(program: str, request: pytest.FixtureRequest) -> Path:
    # asked for here, since pytest would otherwise run the study before it looks for the browser
    folder: Path = request.getfixturevalue("finished").results
    return folder


def serious(page: Browser) -> list[list[str]]:
    """What keeps people from using the open page, all of it unfolded: impact, rule, first element."""
    page.evaluate(OPEN)
    page.settle()
    # the page's own policy forbids it to run code from elsewhere, which this is not
    page.evaluate(f"{AXE}; 0")
    found: list[list[str]] = page.evaluate(RUN)
    return [one for one in found if one[0] in SERIOUS]


def in_dark(page: Browser, *, dark: bool) -> None:
    """Let the page believe that its reader prefers dark colours, or not."""
    features: list[dict[str, Any]] = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    page.call("Emulation.setEmulatedMedia", features=features)


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
