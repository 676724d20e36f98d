"""The page as one file: template, style, scripts, physics and data, with nothing to load."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

TEMPLATES: Final = (
    "templates/explorer.html", "templates/explorer.css", "templates/worker.js", "templates/plots.js",
    "templates/own.js", "templates/page.js",
)  # fmt: skip
LARGEST_BYTES: Final = 2_000_000


def render_page(words: dict[str, str], data: dict[str, Any], physics: str) -> str:
    """Return the page; one that is larger than a page sent by mail should be is refused.

    ``words`` are what the template names: title, cohort_title, experiment, origin.
    """
    html, style, worker, *scripts = map(_template, TEMPLATES)
    environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    page = environment.from_string(html).render(
        **words,
        style=Markup(style),
        worker=Markup(_within_script(f"{physics}\n{worker}")),
        study=Markup(_within_script(json.dumps(data, separators=(",", ":"), ensure_ascii=False))),
        script=Markup("\n".join(scripts)),
    )
    size = len(page.encode())
    if size > LARGEST_BYTES:
        reason = f"the page has {size} bytes, more than {LARGEST_BYTES}"
        raise ValueError(f"{reason}; show fewer subjects, or fewer draws of each")
    return page


def _template(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")


def _within_script(text: str) -> str:
    """Return a text that no browser takes for the end of its script."""
    return text.replace("</", "<\\/").replace("<!--", "<\\!--")
