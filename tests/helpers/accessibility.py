"""What axe-core finds on an open page, in light and dark colours."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from browser import Browser

SERIOUS = ("serious", "critical")
AXE = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")
RUN = """axe.run(document, {resultTypes: ['violations'], preload: false})
    .then(found => found.violations.map(one => [one.impact, one.id, one.nodes[0].html]))"""
OPEN = "document.querySelectorAll('details').forEach(part => part.open = true)"


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
